// The one selection that all panes read and write: pin, line, region, map, range, zoom, frame.

import { computed, effect, signal } from '@preact/signals';
import { fromHash, toHash, type LineSelection, type Selection } from './hash';
import { asked, view, viewNamed, type ViewName } from './route';
import { takeToken } from './token';

export const selection = signal<Selection>(fromHash(''));

/** The pixel under the pointer: a weaker mark than the pin. */
export const hover = signal<{ x: number; y: number } | null>(null);

/** Whether a line or a region is being drawn: nothing on the page may move meanwhile. */
export const drawing = signal(false);

/** Whether the next line is one more, beside those that are there. */
export const addsLine = signal(false);

/** What a drag on the map draws next, or a click: points of a plane to level by. */
export const tool = signal<'pin' | 'line' | 'region' | 'points'>('pin');

export const pin = computed(() => selection.value.pin);
export const line = computed(() => selection.value.line);
export const region = computed(() => selection.value.region);
export const panel = computed(() => selection.value.panel ?? 'pixel');

/** The lines in the order of their letters; the last one has the cursors. */
export const lines = computed(() => {
  const { kept, line: last } = selection.value;
  return last ? [...kept, last] : [];
});

/** Letters of the ends of a line: A and B of the first, C and D of the second, and so on. */
export function lettersOf(index: number): [from: string, to: string] {
  return [String.fromCharCode(65 + 2 * index), String.fromCharCode(66 + 2 * index)];
}

/** Draws a line: in place of the last one, or beside it. */
export function drawLine(ends: Omit<LineSelection, 'width'>): void {
  const { line: last, kept } = selection.peek();
  const line = { ...ends, width: last?.width ?? 5 };
  if (addsLine.peek() && last) select({ line, kept: [...kept, last] });
  else select({ line });
  addsLine.value = false;
}

/** Takes a line away; the one before takes its place. */
export function dropLine(index: number): void {
  const rest = lines.peek().filter((_line, at) => at !== index);
  select({ line: rest.at(-1) ?? null, kept: rest.slice(0, -1) });
}

export function select(change: Partial<Selection>): void {
  selection.value = { ...selection.peek(), ...change };
}

/** Shows another map (or frame): its range starts anew, since units differ. */
export function selectMap(map: string): void {
  select({ map, frame: null, colours: null, range: { mode: 'auto' } });
}

const PAUSE_MS = 200;

/** The fragment of a view; that of the results holds the selection. */
export function hashOf(name: ViewName): string {
  return name === 'results' ? toHash(selection.peek()) : `#${name}`;
}

/** Shows a view. The browser's "back" leads to the one before. */
export function showView(name: ViewName): void {
  if (view.peek() === name) return;
  history.pushState(null, '', hashOf(name));
  asked.value = name;
}

/** Rig and scan have no selection in the address: that of the results stays as it is. */
function readAddress(): void {
  asked.value = viewNamed(location.hash);
  if (asked.peek() === null || asked.peek() === 'results') selection.value = fromHash(location.hash);
}

/**
 * Reads view and selection from the address, and keeps the selection there, written at most every 200 ms.
 * `arrived` is called when another address has come.
 */
export function keepInAddress(arrived: () => void): void {
  readAddress();
  addEventListener('hashchange', () => {
    // Somebody pasted another link into this tab; it may hold a token.
    takeToken();
    readAddress();
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
      if (view.peek() === 'results') history.replaceState(null, '', hashOf('results'));
    }, PAUSE_MS);
  });
}

/** The address of what is on the screen. It never holds the token. */
export function link(): string {
  return location.origin + location.pathname + hashOf(view.peek() ?? 'results');
}
