import { interval } from '../format/number';
import type { SequenceEntry } from './api';

/** Whether there are results to look at. */
export function hasResults({ state }: SequenceEntry): boolean {
  return state === 'matched' || state === 'measured';
}

/** `0.2000 ± 0.0079 mm`; null if the depth was not measured. */
export function depthOf({ depth_mm, half_width_95_mm }: SequenceEntry): string | null {
  return depth_mm === null ? null : interval(depth_mm, half_width_95_mm, 'mm');
}

/** What is known of the measurement of a sequence, in words. */
export function resultOf(entry: SequenceEntry): string {
  if (!hasResults(entry)) return 'not measured yet';
  const depth = depthOf(entry);
  const found = depth === null ? 'measured' : `depth ${depth}`;
  return entry.verdict ? `${found}, ${entry.verdict.toUpperCase()}` : found;
}
