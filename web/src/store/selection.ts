// The one selection that all panes read and write: pin, line, region, map, range, zoom, frame.

import { computed, effect, signal } from '@preact/signals';
import { fromHash, toHash, type Selection } from './hash';
import { takeToken } from './token';

export const selection = signal<Selection>(fromHash(''));

/** The pixel under the pointer: a weaker mark than the pin. */
export const hover = signal<{ x: number; y: number } | null>(null);

/** What a drag on the map draws next. */
export const tool = signal<'pin' | 'line' | 'region'>('pin');

export const pin = computed(() => selection.value.pin);
export const line = computed(() => selection.value.line);
export const region = computed(() => selection.value.region);
export const panel = computed(() => selection.value.panel ?? 'pixel');

export function select(change: Partial<Selection>): void {
  selection.value = { ...selection.peek(), ...change };
}

/** Shows another map (or frame): its range starts anew, since units differ. */
export function selectMap(map: string): void {
  select({ map, frame: null, colours: null, range: { mode: 'auto' } });
}

const PAUSE_MS = 200;

/**
 * Reads the selection from the address, and keeps it there, written at most every 200 ms. `arrived` is called
 * when another address has come.
 */
export function keepInAddress(arrived: () => void): void {
  selection.value = fromHash(location.hash);
  addEventListener('hashchange', () => {
    // Somebody pasted another link into this tab; it may hold a token.
    takeToken();
    selection.value = fromHash(location.hash);
    arrived();
  });
  let timer: ReturnType<typeof setTimeout> | undefined;
  let first = true;
  effect(() => {
    void selection.value;
    if (first) {
      first = false;
      return;
    }
    timer ??= setTimeout(() => {
      timer = undefined;
      history.replaceState(null, '', toHash(selection.peek()));
    }, PAUSE_MS);
  });
}

/** The address of what is on the screen. It never holds the token. */
export function link(): string {
  return location.origin + location.pathname + toHash(selection.peek());
}
