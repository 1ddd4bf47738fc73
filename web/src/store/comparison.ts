// The difference to another folder of results: loaded whole (at most 1024 x 1024 values), shown as a map.

import { signal } from '@preact/signals';
import { api, type CompareInfo } from '../api';

export interface Comparison {
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

/** Loads the difference of `map` to the results `other`; null ends the comparison. */
export async function compareWith(other: string | null, map: string): Promise<void> {
  number += 1;
  const mine = number;
  comparisonError.value = null;
  comparison.value = null;
  comparing.value = other !== null;
  if (other === null) return;
  try {
    const { head, values } = await api.compare(other, map);
    if (mine !== number) return;
    const size = head.rows * head.columns;
    const [difference, inSigma] = [values.subarray(0, size), values.subarray(size, 2 * size)];
    comparison.value = { other, map, info: head, difference, inSigma };
  } catch (error) {
    if (mine === number) comparisonError.value = error instanceof Error ? error.message : String(error);
  }
  if (mine === number) comparing.value = false;
}
