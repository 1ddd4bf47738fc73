// The live picture as panes know it: its head, its age, and which overlays are on.

import { computed, signal } from '@preact/signals';
import type { PictureHead } from './api';
import { freshness } from './texts';

/** The last picture's head; null before the first one, and while no view shows pictures. */
export const head = signal<PictureHead | null>(null);

/** Its age now; told several times a second. */
export const age_ms = signal<number | null>(null);

/** Whether the picture is too old for its numbers to be of use. */
export const stale = computed(() => age_ms.value !== null && freshness(age_ms.value) === 'stale');

export const overlays = {
  zebra: signal(true),
  grid: signal(false),
  peaking: signal(false),
  vignetting: signal(false),
};
