// The maps of codes: what each code means, and its pattern, so that nothing depends on colour.

export interface Code {
  code: number;
  words: string;
  /** Index of the pattern in the shader and in the legend; 0 is plain. */
  pattern: number;
  /** Grey level from 0 to 1. */
  grey: number;
}

export const MASK_CODES: Code[] = [
  { code: 0, words: 'found', pattern: 0, grey: 0.36 },
  { code: 1, words: 'leaves the image', pattern: 1, grey: 0.62 },
  { code: 2, words: 'beyond the range', pattern: 2, grey: 0.62 },
  { code: 3, words: 'too uncertain', pattern: 3, grey: 0.62 },
  { code: 4, words: 'occluded', pattern: 4, grey: 0.62 },
  { code: 5, words: 'ambiguous', pattern: 5, grey: 0.62 },
  { code: 6, words: 'outside mask or region', pattern: 0, grey: 0.15 },
];

export const USED_CODES: Code[] = [
  { code: 0, words: 'no height', pattern: 5, grey: 0.2 },
  { code: 1, words: 'not used', pattern: 1, grey: 0.4 },
  { code: 2, words: 'used, but not for levels', pattern: 3, grey: 0.6 },
  { code: 3, words: 'used', pattern: 0, grey: 0.85 },
];

/** The codes of a map, or null if it holds quantities. */
export function codesOf(mapId: string): Code[] | null {
  if (mapId === 'mask') return MASK_CODES;
  if (mapId === 'used') return USED_CODES;
  return null;
}
