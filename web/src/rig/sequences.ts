// The sequences that the server has, and which of them the results view shows.

import { signal } from '@preact/signals';
import { load } from '../store/results';
import { select } from '../store/selection';
import { rig, type SequenceEntry } from './api';
import { order } from './store';

export const sequences = signal<SequenceEntry[] | null>(null);

export async function loadSequences(): Promise<void> {
  sequences.value = (await order(rig.sequences())) ?? sequences.peek();
}

/** Shows the results of a sequence. */
export async function openSequence(name: string): Promise<void> {
  try {
    await rig.openResults(name);
  } catch (error) {
    await order(Promise.reject(error));
    return;
  }
  // What was compared with the one before says nothing of this one.
  select({ compareSequence: null });
  await load();
}
