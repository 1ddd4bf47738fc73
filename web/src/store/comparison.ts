// The difference to other results, or to another sequence: loaded whole (at most 1024 x 1024 values), shown as a map.

import { signal } from '@preact/signals';
import { api, type CompareInfo } from '../api';

/** What is compared with: other results of the same sequence, or another sequence. */
export type Other = { results: string } | { sequence: string };

export interface Comparison {
  /** Its name. */
  other: string;
  map: string;
  info: CompareInfo;
  difference: Float32Array;
  /** Difference over the combined sigma. */
  inSigma: Float32Array;
}

export const comparison = signal<Comparison | null>(null);
export const comparisonError = signal<string | null>(null);
export const comparing = signal(false);

let number = 0;

/** Loads the difference to `other`, of `map` if both are of one sequence; null ends the comparison. */
export async function compareWith(other: Other | null, map: string): Promise<void> {
  number += 1;
  const mine = number;
  comparisonError.value = null;
  comparison.value = null;
  comparing.value = other !== null;
  if (other === null) return;
  try {
    const ofSequence = 'sequence' in other;
    const { head, values } = await (ofSequence
      ? api.compareSequence(other.sequence)
      : api.compare(other.results, map));
    if (mine !== number) return;
    const size = head.rows * head.columns;
    const [difference, inSigma] = [values.subarray(0, size), values.subarray(size, 2 * size)];
    comparison.value = {
      other: ofSequence ? other.sequence : other.results,
      map: ofSequence ? 'height' : map,
      info: head,
      difference,
      inSigma,
    };
  } catch (error) {
    if (mine === number) comparisonError.value = error instanceof Error ? error.message : String(error);
  }
  if (mine === number) comparing.value = false;
}
