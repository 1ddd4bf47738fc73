// What is chosen in the view of all sequences. It stays while other views are shown.

import { computed, signal } from '@preact/signals';
import { rig } from '../rig/api';
import { hasResults } from '../rig/results_words';
import { sequences } from '../rig/sequences';
import { taken } from '../scan/control';
import { NOTHING, toHash } from '../store/hash';
import { about } from '../store/results';
import type { SequenceEntry, TrendQuestion } from '../types';
import { filtered, sorted, type Column, type Order } from './rows';

export const filter = signal('');
export const sorting = signal<Order>({ column: 'created', descending: true });

const asked = signal<string[]>([]);

/** Names of the sequences to compare, as far as they are still there: two at most. */
export const chosen = computed(() => {
  const there = new Set((sequences.value ?? []).map(({ name }) => name));
  return asked.value.filter((name) => there.has(name));
});

/** The quantity of the chart. */
export const measure = signal<TrendQuestion['measure']>('depth');

/** The rows of the table. */
export const rows = computed(() => sorted(filtered(sequences.value ?? [], filter.value), sorting.value));

/** Sorts by a column; the second time the other way round. */
export function sortBy(column: Column): void {
  const now = sorting.peek();
  const descending = now.column === column ? !now.descending : column === 'created';
  sorting.value = { column, descending };
}

/** Whether heights of a sequence can be compared. */
export function isComparable(entry: SequenceEntry): boolean {
  return hasResults(entry) && entry.problem === null;
}

export function choose(name: string, on: boolean): void {
  const others = chosen.peek().filter((one) => one !== name);
  asked.value = on ? [...others, name] : others;
}

/** The two that are chosen: the one to open, and the one to compare it with; null without two. */
export const pair = computed<[string, string] | null>(() => {
  const there = (sequences.value ?? []).filter(({ name }) => chosen.value.includes(name));
  const [one, other] = sorted(there, { column: 'created', descending: true });
  if (!one || !other) return null;
  // What is open stays open; else the newer one is told by how it differs from the older.
  return other.name === about.value?.sequence ? [other.name, one.name] : [one.name, other.name];
});

/** Opens a sequence, and its difference to another one. */
export async function compare([first, second]: [string, string]): Promise<void> {
  if (first !== about.peek()?.sequence && !(await taken(rig.openResults(first)))) return;
  const shown = { map: 'difference', panel: 'compare', compareSequence: second };
  location.hash = toHash({ ...NOTHING, ...shown });
}
