// The live map: asked for when the state tells of another one, and kept with the range of its colours.

import { computed, effect, signal } from '@preact/signals';
import { framed, type Framed } from '../api';
import { measured, spoken } from '../format/number';
import type { LiveMapHead } from '../rig/api';
import { rigState } from '../rig/store';
import { pageVisible } from './control';
import { fresh, heldBy, type HeldRange } from './held_range';

export type LiveKind = 'disparity' | 'sigma';
type LiveMap = Framed<LiveMapHead>;

export interface LivePair {
  scan: string;
  number: number;
  disparity: LiveMap;
  sigma: LiveMap;
}

/** A value of the map, by its row and column. */
export interface Cell {
  row: number;
  column: number;
}

export const liveKind = signal<LiveKind>('disparity');
export const livePair = signal<LivePair | null>(null);
export const liveRanges = signal<Record<LiveKind, HeldRange | null>>({ disparity: null, sigma: null });
export const liveFault = signal<string | null>(null);
export const livePin = signal<Cell | null>(null);
export const liveHover = signal<Cell | null>(null);

/** The map that is shown. */
export const liveMap = computed<LiveMap | null>(() => livePair.value?.[liveKind.value] ?? null);

/** A logarithm needs ends above 0. */
export const liveRange = computed<HeldRange | null>(() => {
  const range = liveRanges.value[liveKind.value];
  if (!range || liveKind.value === 'disparity') return range;
  const high = Math.max(range.high, 1e-9);
  return { ...range, high, low: Math.max(range.low, high * 1e-4) };
});

/** Takes the range of the map that is shown, whatever was held before. */
export function rangeAnew(): void {
  const map = liveMap.peek();
  if (map) liveRanges.value = { ...liveRanges.peek(), [liveKind.peek()]: fresh(map.head) };
}

const RETRY_MS = 2000;

const scanName = computed(() => rigState.value?.scan?.name ?? null);
const mapNumber = computed(() => rigState.value?.scan?.map?.number ?? null);

function forget(): void {
  livePair.value = null;
  liveRanges.value = { disparity: null, sigma: null };
  livePin.value = null;
  liveHover.value = null;
  liveFault.value = null;
}

async function fetchPair(scan: string, number: number): Promise<void> {
  const ask = (kind: LiveKind): Promise<LiveMap> => framed<LiveMapHead>(`api/scan/map?kind=${kind}`);
  const [disparity, sigma] = await Promise.all([ask('disparity'), ask('sigma')]);
  if (scanName.peek() !== scan) return;
  const held = liveRanges.peek();
  liveRanges.value = {
    disparity: heldBy(held.disparity, disparity.head),
    sigma: heldBy(held.sigma, sigma.head),
  };
  livePair.value = { scan, number, disparity, sigma };
}

/** Follows the map until the function that it returns is called. */
export function followLiveMap(): () => void {
  let ended = false;
  let running = false;
  let timer: ReturnType<typeof setTimeout> | undefined;

  const pump = async (): Promise<void> => {
    const [scan, number, held] = [scanName.peek(), mapNumber.peek(), livePair.peek()];
    if (ended || running || !pageVisible.peek() || scan === null || number === null) return;
    if (held?.scan === scan && held.number === number) return;
    running = true;
    try {
      await fetchPair(scan, number);
      liveFault.value = null;
    } catch (error) {
      liveFault.value = error instanceof Error ? error.message : String(error);
      clearTimeout(timer);
      timer = setTimeout(() => void pump(), RETRY_MS);
      return;
    } finally {
      running = false;
    }
    void pump();
  };

  const endings = [
    effect(() => {
      const name = scanName.value;
      if (livePair.peek() && livePair.peek()?.scan !== name) forget();
    }),
    effect(() => {
      void [scanName.value, mapNumber.value, pageVisible.value];
      void pump();
    }),
  ];
  return () => {
    ended = true;
    clearTimeout(timer);
    for (const end of endings) end();
  };
}

/** The value of a cell, what is said of it, and where it is in px of the frame. */
export function cellText(pair: LivePair, { row, column }: Cell): { text: string; spoken: string } {
  const { head, values } = pair.disparity;
  const middle = Math.floor(head.bin / 2);
  const place = `at (${column * head.bin + middle}, ${row * head.bin + middle})`;
  const value = values[row * head.columns + column] ?? NaN;
  const sigma = pair.sigma.values[row * head.columns + column] ?? NaN;
  if (!Number.isFinite(value)) return { text: `${place}: no value`, spoken: `${place} no value` };
  const known = Number.isFinite(sigma) ? sigma : null;
  return {
    text: `${place}: ${measured(value, known, head.unit)}`,
    spoken: `${place} ${spoken(value, known, head.unit)}`,
  };
}
