// How the page looks: kept in this browser, not in the address.

import { computed, effect, signal, type Signal } from '@preact/signals';
import { PALETTES } from '../components/palette';

function kept<T extends string>(key: string, values: readonly T[], start: T): Signal<T> {
  const stored = localStorage.getItem(key) as T | null;
  const state = signal<T>(stored && values.includes(stored) ? stored : start);
  effect(() => localStorage.setItem(key, state.value));
  return state;
}

export const themeChoice = kept('epirig-theme', ['system', 'dark', 'light'] as const, 'system');
export const letterKeys = kept('epirig-letter-keys', ['on', 'off'] as const, 'on');

export const hillshade = signal(false);
export const maskHatch = signal(true);
/** Whether values beyond the range are striped; else they have the colour of its end. */
export const clipMarks = kept('epirig-clip-marks', ['off', 'on'] as const, 'off');
/** Opacity of the photograph over the map, from 0 to 1. */
export const photo = signal(0);
/** How much too large heights are in 3-D; null for as much as shows the relief. */
export const exaggeration = signal<number | null>(null);

const systemDark = matchMedia('(prefers-color-scheme: dark)');
const dark = signal(systemDark.matches);
systemDark.addEventListener('change', (event) => (dark.value = event.matches));

export const theme = computed<'dark' | 'light'>(() =>
  themeChoice.value === 'system' ? (dark.value ? 'dark' : 'light') : themeChoice.value,
);

/** Colours for canvases; style sheets read the same ones as variables. */
export const palette = computed(() => PALETTES[theme.value]);

export function applyTheme(): void {
  effect(() => {
    const root = document.documentElement;
    root.dataset.theme = theme.value;
    root.style.colorScheme = theme.value;
    for (const [name, colour] of Object.entries(palette.value)) root.style.setProperty(`--${name}`, colour);
  });
}
