// Keys of the whole page. Letters do nothing while a person types, and can be turned off.

import { select, selection, selectMap, tool } from '../store/selection';
import { results } from '../store/results';
import { letterKeys } from '../store/settings';
import { handleOf } from './handle';
import { copyLink, keySheetOpen } from '../store/actions';

export const KEYS: [keys: string, words: string][] = [
  ['arrow keys', 'move the pin by 1 px, with Shift by 10 px'],
  ['+  \u2212  0', 'zoom in, zoom out, show all'],
  ['M', 'next map'],
  ['R', 'next range: auto, full'],
  ['L', 'draw a line'],
  ['A', 'draw a region'],
  ['C', 'copy the link to this view'],
  [',  .', 'frame before, frame after'],
  ['?', 'this list'],
  ['Esc', 'stop drawing; close'],
];

const ARROWS: Record<string, [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

function nextMap(): void {
  const ids = results.peek()?.maps.map(({ id }) => id) ?? [];
  const next = ids[(ids.indexOf(selection.peek().map ?? '') + 1) % ids.length];
  if (next) selectMap(next);
}

function step(by: number): void {
  const frames = results.peek()?.frames;
  if (!frames) return;
  const now = selection.peek().frame ?? frames.reference;
  select({ frame: (now + by + frames.count) % frames.count });
}

const LETTERS: Record<string, () => void> = {
  m: nextMap,
  r: () => select({ range: { mode: selection.peek().range.mode === 'auto' ? 'full' : 'auto' } }),
  l: () => (tool.value = 'line'),
  a: () => (tool.value = 'region'),
  c: () => void copyLink(),
  ',': () => step(-1),
  '.': () => step(1),
  '?': () => (keySheetOpen.value = true),
};

const SIGNS: Record<string, () => void> = {
  '+': () => handleOf.peek()?.zoomBy(1.5),
  '=': () => handleOf.peek()?.zoomBy(1.5),
  '-': () => handleOf.peek()?.zoomBy(1 / 1.5),
  '0': () => handleOf.peek()?.fit(),
};

function onKey(event: KeyboardEvent): void {
  if (event.ctrlKey || event.metaKey || event.altKey || keySheetOpen.peek()) return;
  const target = event.target as HTMLElement;
  if (target.closest('input, select, textarea, [contenteditable]')) return;
  if (event.key === 'Escape') tool.value = 'pin';
  const arrow = ARROWS[event.key];
  if (arrow) {
    // Tabs, sliders and lists have arrow keys of their own.
    if (target !== document.body && target.id !== 'map') return;
    event.preventDefault();
    const far = event.shiftKey ? 10 : 1;
    handleOf.peek()?.movePin(arrow[0] * far, arrow[1] * far);
    return;
  }
  const act =
    SIGNS[event.key] ?? (letterKeys.peek() === 'on' ? LETTERS[event.key.toLowerCase()] : undefined);
  if (!act) return;
  event.preventDefault();
  act();
}

export function listenToKeys(): void {
  addEventListener('keydown', onKey);
}
