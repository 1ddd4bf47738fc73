import type { SequenceEntry } from './api';

/** What is known of the measurement of a sequence, in words. */
export function resultOf({ measured, depth, verdict }: SequenceEntry): string {
  if (!measured) return 'not measured yet';
  const found = depth === null ? 'measured' : `depth ${depth.replace('+-', '±')}`;
  return verdict ? `${found}, ${verdict.toUpperCase()}` : found;
}
