// A verdict by colour, always beside its word.

import type { SequenceEntry } from '../types';

type Verdict = NonNullable<SequenceEntry['verdict']>;

export const VERDICT_COLOURS: Record<Verdict, string> = {
  pass: 'verdict-good',
  fail: 'verdict-bad',
  undecided: 'verdict-warning',
};
