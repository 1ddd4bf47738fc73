// Keys of the whole page, by view. Letters do nothing while a person types, and can be turned off.

import { overlays } from '../rig/picture_store';
import { toggleTarget } from '../rig/targeting';
import { mode, view, type ViewName } from '../store/route';
import { addsLine, select, selection, selectMap, showView, tool } from '../store/selection';
import { choose } from '../store/levelled';
import { results } from '../store/results';
import { letterKeys } from '../store/settings';
import { handleOf } from './handle';
import { copyLink, keySheetOpen } from '../store/actions';

type Key = [keys: string, words: string];

const RESULT_KEYS: Key[] = [
  ['arrow keys', 'move the pin by 1 px, with Shift by 10 px'],
  ['+  \u2212  0', 'zoom in, zoom out, show all'],
  ['M', 'next map'],
  ['R', 'next range: auto, full'],
  ['L', 'draw a line'],
  ['A', 'draw a region'],
  ['Enter', 'while points to level by are chosen: take the pin'],
  ['C', 'copy the link to this view'],
  [',  .', 'frame before, frame after'],
];

const RIG_KEYS: Key[] = [
  ['+  \u2212  0', 'zoom in, zoom out, show all'],
  ['arrow keys', 'move the picture, while it has the focus'],
  ['Z', 'mark saturated (stripes) and dark (dots) pixels'],
  ['G', 'grid'],
  ['F', 'focus peaking'],
  ['V', 'vignetting'],
  ['T', 'find the target'],
  ['Space, Enter', 'held on a jog button: move'],
];

const SCAN_KEYS: Key[] = [['+  \u2212  0', 'zoom in, zoom out, show all']];

/** The keys of the view on the screen. */
export function keysOf(shown: ViewName | null): Key[] {
  const own = { rig: RIG_KEYS, scan: SCAN_KEYS, results: RESULT_KEYS, sequences: [] }[shown ?? 'results'];
  if (mode.peek() !== 'ui') return [...own, ['?', 'this list'], ['Esc', 'stop drawing; close']];
  return [
    ['Esc, Pause', 'STOP: all motion ends, a scan is paused'],
    ['1  2  3  4', 'Rig, Scan, Results, Sequences'],
    ...own,
    ['?', 'this list'],
  ];
}

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

const toggle = (name: keyof typeof overlays) => (): void => {
  overlays[name].value = !overlays[name].peek();
};

type Acts = Record<string, () => void>;

const RESULT_LETTERS: Acts = {
  m: nextMap,
  r: () => select({ range: { mode: selection.peek().range.mode === 'auto' ? 'full' : 'auto' } }),
  l: () => (tool.value = 'line'),
  a: () => (tool.value = 'region'),
  c: () => void copyLink(),
  ',': () => step(-1),
  '.': () => step(1),
};

const RIG_LETTERS: Acts = {
  z: toggle('zebra'),
  g: toggle('grid'),
  f: toggle('peaking'),
  v: toggle('vignetting'),
  t: toggleTarget,
};

const VIEWS: Acts = {
  '1': () => showView('rig'),
  '2': () => showView('scan'),
  '3': () => showView('results'),
  '4': () => showView('sequences'),
};

/** What letters and digits do now. */
function actOf(key: string): (() => void) | undefined {
  if (letterKeys.peek() === 'off') return undefined;
  if (key === '?') return () => (keySheetOpen.value = true);
  if (mode.peek() === 'ui' && VIEWS[key]) return VIEWS[key];
  if (view.peek() === 'rig') return RIG_LETTERS[key];
  return view.peek() === 'results' ? RESULT_LETTERS[key] : undefined;
}

const SIGNS: Acts = {
  '+': () => handleOf.peek()?.zoomBy(1.5),
  '=': () => handleOf.peek()?.zoomBy(1.5),
  '-': () => handleOf.peek()?.zoomBy(1 / 1.5),
  '0': () => handleOf.peek()?.fit(),
};

function onKey(event: KeyboardEvent): void {
  if (event.ctrlKey || event.metaKey || event.altKey || keySheetOpen.peek()) return;
  const target = event.target as HTMLElement;
  if (target.closest('input, select, textarea, [contenteditable], dialog')) return;
  if (event.key === 'Escape') {
    tool.value = 'pin';
    addsLine.value = false;
  }
  const arrow = ARROWS[event.key];
  if (arrow) {
    // Tabs, sliders and lists have arrow keys of their own; a picture of the rig moves when it has the focus.
    const free = target === document.body && view.peek() !== 'rig';
    if (!free && target.id !== 'map') return;
    event.preventDefault();
    const far = event.shiftKey ? 10 : 1;
    handleOf.peek()?.movePin(arrow[0] * far, arrow[1] * far);
    return;
  }
  if (
    event.key === 'Enter' &&
    tool.peek() === 'points' &&
    (target === document.body || target.id === 'map')
  ) {
    const at = selection.peek().pin;
    if (at) choose(at);
    return;
  }
  const act = SIGNS[event.key] ?? actOf(event.key.toLowerCase());
  if (!act) return;
  event.preventDefault();
  act();
}

export function listenToKeys(): void {
  addEventListener('keydown', onKey);
}
