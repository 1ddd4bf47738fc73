// Which view is on the screen: told by the address, as far as the program has such a view.

import { computed, signal } from '@preact/signals';

export type ViewName = 'rig' | 'scan' | 'results' | 'sequences';

/** What the program is: `epirig view` has only results. null until it has told. */
export const mode = signal<'view' | 'ui' | null>(null);

/** The view that a fragment names; null if it names none. */
export function viewNamed(hash: string): ViewName | null {
  const name = /^#(rig|scan|results|sequences)(?![^/?])/.exec(hash)?.[1];
  return (name as ViewName | undefined) ?? null;
}

/** The view that the address names. */
export const asked = signal<ViewName | null>(null);

/** The view on the screen; null until the mode is known. */
export const view = computed<ViewName | null>(() => {
  if (mode.value === null) return null;
  return mode.value === 'view' ? 'results' : (asked.value ?? 'rig');
});
