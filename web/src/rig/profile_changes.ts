// What a person has changed in the profile, and where mistakes belong.

import { signal } from '@preact/signals';
import type { Profile, ProfileKey, ProfileMistake } from './api';

/** The section that another view asks the form to open, for example "plan". */
export const openSection = signal<string | null>(null);

/** Texts that were typed, by path; an empty text means "not set". */
export type Typed = Record<string, string>;

/** What the field of a key shows. */
export function shown(key: ProfileKey, typed: Typed): string {
  return typed[key.path] ?? key.value ?? '';
}

export function isChanged(key: ProfileKey, typed: Typed): boolean {
  return shown(key, typed).trim() !== (key.value ?? '');
}

/** Only the values that differ from those of the profile. */
export function changes(profile: Profile, typed: Typed): Record<string, string> {
  const changed = profile.sections
    .flatMap(({ keys }) => keys)
    .filter((key) => isChanged(key, typed))
    .map((key) => [key.path, shown(key, typed).trim()]);
  return Object.fromEntries(changed) as Record<string, string>;
}

/** The values that a person can choose from, or null where text is typed. */
export function choicesOf({ choices, allowed }: ProfileKey): string[] | null {
  return choices ?? (allowed === 'true or false' ? ['true', 'false'] : null);
}

/** Mistakes at each key, and those that belong to no key of the form. */
export function sortMistakes(
  profile: Profile,
  mistakes: ProfileMistake[],
): { at: Map<string, string[]>; other: string[] } {
  const paths = new Set(profile.sections.flatMap(({ keys }) => keys.map(({ path }) => path)));
  const at = new Map<string, string[]>();
  const other: string[] = [];
  for (const { key, words } of mistakes) {
    if (key !== null && paths.has(key)) at.set(key, [...(at.get(key) ?? []), words]);
    else other.push(words);
  }
  return { at, other };
}

/** The keys that are shown: those without effect only if asked for, changed, or wrong. */
export function visibleKeys(
  keys: ProfileKey[],
  typed: Typed,
  at: Map<string, string[]>,
  all: boolean,
): ProfileKey[] {
  return keys.filter((key) => all || key.applies || isChanged(key, typed) || at.has(key.path));
}

/** Whether a refusal to save is because the file is there. */
export function fileExists(message: string): boolean {
  return /\bexists?\b|\boverwrit|\breplac/i.test(message);
}
