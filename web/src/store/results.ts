// What the server holds: loaded once, then read by all panes.

import { computed, signal } from '@preact/signals';
import { api, type About, type Results, type Trend } from '../api';
import { lengthUnit, shownUnit, type LengthUnit } from '../format/lengths';
import { pin, select, selection } from './selection';

export const about = signal<About | null>(null);
export const results = signal<Results | null>(null);
export const trends = signal<Trend[]>([]);
export const loadError = signal<string | null>(null);

/** The unit of all lengths along z. */
export const lengths = computed<LengthUnit>(() => {
  const height = results.value?.maps.find((map) => map.id === 'height');
  return lengthUnit(height?.low ?? null, height?.high ?? null);
});

/** Label and factor for values whose unit is `unit`. */
export function unitOf(unit: string): { label: string; factor: number } {
  return shownUnit(unit, lengths.value);
}

export async function load(): Promise<void> {
  try {
    loadError.value = null;
    about.value = await api.about();
    results.value = await api.results();
    const ids = results.value.maps.map((map) => map.id);
    const wanted = selection.peek().map;
    const local = wanted === 'difference' || wanted === 'difference-sigma';
    if (!wanted || (!ids.includes(wanted) && !local)) select({ map: ids[0] ?? null });
    const { rows, columns } = results.value.frames;
    const at = pin.peek();
    if (at && (at.x < 0 || at.y < 0 || at.x >= columns || at.y >= rows)) select({ pin: null });
    trends.value = results.value.geometry ? await api.trends() : [];
  } catch (error) {
    loadError.value = error instanceof Error ? error.message : String(error);
  }
}
