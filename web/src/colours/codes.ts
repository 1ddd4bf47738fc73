// How the classes of a map look: each has a pattern, so that nothing depends on colour.

import type { MapClass } from '../api';

export interface Code extends MapClass {
  code: number;
  /** Index of the pattern in the shader and in the legend; 0 is plain. */
  pattern: number;
  /** Grey level from 0 to 1. */
  grey: number;
}

/** Looks of the first, the second, ... class. */
const LOOKS = [
  { pattern: 0, grey: 0.36 },
  { pattern: 1, grey: 0.62 },
  { pattern: 2, grey: 0.62 },
  { pattern: 3, grey: 0.62 },
  { pattern: 4, grey: 0.62 },
  { pattern: 5, grey: 0.62 },
  { pattern: 0, grey: 0.15 },
];

/** The codes of a map with these classes, or null if it holds quantities. */
export function codesOf(classes: MapClass[]): Code[] | null {
  if (classes.length === 0) return null;
  return classes.map((one, code) => ({ ...one, code, ...LOOKS[code % LOOKS.length]! }));
}
