// What the server holds: loaded once, then read by all panes.

import { computed, signal } from '@preact/signals';
import { api, askAbout, onOutdated, type About, type Results, type Trend } from '../api';
import { lengthUnit, shownUnit, type LengthUnit } from '../format/lengths';
import { say } from './notices';
import { mode } from './route';
import { select, selection } from './selection';

export const about = signal<About | null>(null);
export const results = signal<Results | null>(null);
export const trends = signal<Trend[]>([]);
export const loadError = signal<string | null>(null);

/** The range of the heights as they are shown while they are levelled, else null. */
export const levelledRange = signal<{ low: number; high: number } | null>(null);

/** The unit of all lengths along z. */
export const lengths = computed<LengthUnit>(() => {
  const height = levelledRange.value ?? results.value?.maps.find((map) => map.id === 'height');
  return lengthUnit(height?.low ?? null, height?.high ?? null);
});

/** Label and factor for values whose unit is `unit`. */
export function unitOf(unit: string): { label: string; factor: number } {
  return shownUnit(unit, lengths.value);
}

/** An address may name what these results do not have: such parts are dropped. */
function keepWithin({ maps, frames, others }: Results, sequence: string | null): void {
  const { map, pin, frame, compare, compareSequence: asked } = selection.peek();
  const inside = pin && pin.x >= 0 && pin.y >= 0 && pin.x < frames.columns && pin.y < frames.rows;
  const other = compare && others.includes(compare) ? compare : null;
  // The server knows whether there is such a sequence.
  const compareSequence = asked === sequence ? null : asked;
  const compares = other !== null || compareSequence !== null;
  const known = maps.some(({ id }) => id === map) || (compares && map?.startsWith('difference'));
  select({
    map: known ? map : (maps[0]?.id ?? null),
    pin: inside ? pin : null,
    frame: frame !== null && frame >= 0 && frame < frames.count ? frame : null,
    compare: other,
    compareSequence,
  });
}

/** Returns whether the results are there; else `loadError` says why not. */
export async function load(): Promise<boolean> {
  try {
    loadError.value = null;
    const told = await api.about();
    about.value = told;
    mode.value = told.mode;
    // `epirig ui` may have no sequence yet.
    const held = told.sequence === null && told.mode === 'ui' ? null : await api.results();
    askAbout(held?.id ?? null);
    results.value = held;
    if (held) keepWithin(held, told.sequence);
    trends.value = held?.geometry ? await api.trends() : [];
    return true;
  } catch (error) {
    loadError.value = error instanceof Error ? error.message : String(error);
    return false;
  }
}

let loading = false;
/** Which results could not be loaded: the person tries them again, not the clock. */
let failed: string | null | undefined;

/** Loads the results anew if there are others by now: after another match, or if another page has opened some. */
export async function follow(): Promise<void> {
  if (loading) return;
  loading = true;
  const { results: id } = await api.about().catch(() => ({ results: undefined }));
  if (id !== undefined && id !== failed) {
    failed = undefined;
    if (id !== (results.peek()?.id ?? null)) {
      if (await load()) say('The results have changed; these are the new ones.');
      else failed = id;
    }
  }
  loading = false;
}

onOutdated(() => void follow());
