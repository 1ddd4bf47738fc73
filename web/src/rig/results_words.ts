import type { SequenceEntry } from './api';

/** What is known of the measurement of a sequence, in words. */
export function resultOf({ measured, depth }: SequenceEntry): string {
  if (!measured) return 'not measured yet';
  return depth === null ? 'measured' : `depth ${depth.replace('+-', '±')}`;
}
