// Levelling of the heights: for the eye alone, nothing of the results is changed. The server takes the plane away.

import { computed, effect, signal } from '@preact/signals';
import { api, type LevelledInfo } from '../api';
import { levellingText, type Levelling, type Pin, type Region } from './hash';
import { latest } from './latest';
import { levelledRange, results } from './results';
import { select, selection, tool } from './selection';

/** The maps of heights, which are levelled together. */
const HEIGHTS = ['height', 'height-measured'];

export function isHeight(map: string): boolean {
  return HEIGHTS.includes(map);
}

type Infos = Map<string, LevelledInfo>;

/** A plane for each map of heights. */
export const levelling = latest<string, Infos>(async (by, abort) => {
  const ids = (results.peek()?.maps ?? []).map(({ id }) => id).filter(isHeight);
  const infos = await Promise.all(ids.map((id) => api.levelled(id, by, abort)));
  return new Map(ids.map((id, index) => [id, infos[index]!]));
}, 0);

/** `levelled by region (10, 10) to (90, 50) px`, where the last pixel is named. */
export function levellingWords(level: Levelling): string {
  if ('points' in level)
    return `levelled by points ${level.points.map(({ x, y }) => `(${x}, ${y})`).join(', ')} px`;
  const [x0, y0, x1, y1] = level.region;
  return `levelled by region (${x0}, ${y0}) to (${x1 - 1}, ${y1 - 1}) px`;
}

/** What the heights on the page are levelled by; null while they are as measured. */
export const levelled = computed<{ by: string; words: string; infos: Infos } | null>(() => {
  const { level } = selection.value;
  const { of, value, error } = levelling.state.value;
  const by = level && levellingText(level);
  return level && by !== null && value && of === by && !error
    ? { by, words: levellingWords(level), infos: value }
    : null;
});

/** The same as questions say it. */
export const levelledBy = computed(() => levelled.value?.by ?? null);

/** Points of the next plane, as far as they are chosen. */
export const chosen = signal<Pin[]>([]);

/** What the map marks of it. */
export const levelMarks = computed<{ region: Region | null; points: Pin[] }>(() => {
  const by = selection.value.level;
  if (tool.value === 'points' || !by) return { region: null, points: chosen.value };
  return 'region' in by ? { region: by.region, points: [] } : { region: null, points: by.points };
});

/** Takes a point of the next plane; the third one levels. */
export function choose(at: Pin): void {
  const [one, two] = chosen.peek();
  if (!one || !two) {
    chosen.value = [...chosen.peek(), at];
    return;
  }
  level({ points: [one, two, at] });
  tool.value = 'pin';
}

/** Levels, or goes back to the heights as measured. Ranges by hand are those of other heights. */
export function level(by: Levelling | null): void {
  select({ level: by, range: { mode: 'auto' } });
}

export function followLevelling(): void {
  const asked = computed(() => {
    const { level: by } = selection.value;
    return by && results.value?.geometry ? levellingText(by) : null;
  });
  effect(() => {
    void results.value?.id;
    levelling.ask(asked.value);
  });
  effect(() => {
    const info = levelled.value?.infos.get('height');
    levelledRange.value = info ? { low: info.low, high: info.high } : null;
  });
  effect(() => {
    // Whoever takes up something else begins anew with the points.
    if (tool.value !== 'points') chosen.value = [];
    // What is drawn is drawn on the map.
    if (tool.value !== 'pin' && selection.peek().solid) select({ solid: false });
  });
}
