// The selection as text, for the address: `#results/height?p=512,430&l=100,430,900,430,5`. Short, since long
// addresses slow browsers down.

import type { Colours, FrameKind } from '../api';
import type { View } from '../map/view';

export interface Pin {
  x: number;
  y: number;
}

export interface LineSelection {
  x0: number;
  y0: number;
  x1: number;
  y1: number;
  width: number;
}

export type Region = [x0: number, y0: number, x1: number, y1: number];

export type Range = { mode: 'auto' } | { mode: 'full' } | { mode: 'hand'; low: number; high: number };

export interface Selection {
  map: string | null;
  pin: Pin | null;
  line: LineSelection | null;
  region: Region | null;
  /** Where the map is looked at; null for what has answers. */
  view: View | 'all' | null;
  colours: Colours | null;
  range: Range;
  frame: number | null;
  kind: FrameKind | null;
  compare: string | null;
  panel: string | null;
}

export const NOTHING: Selection = {
  map: null,
  pin: null,
  line: null,
  region: null,
  view: null,
  colours: null,
  range: { mode: 'auto' },
  frame: null,
  kind: null,
  compare: null,
  panel: null,
};

function short(value: number, digits: number): string {
  return String(Number(value.toPrecision(digits)));
}

function rangeText(range: Range): string | null {
  if (range.mode === 'full') return 'f';
  return range.mode === 'hand' ? `${short(range.low, 6)},${short(range.high, 6)}` : null;
}

function viewText(view: Selection['view']): string | null {
  if (view === null || view === 'all') return view;
  return [short(view.x, 6), short(view.y, 6), short(view.zoom, 4)].join(',');
}

/** The fragment of the address, with its `#`. */
export function toHash(selection: Selection): string {
  const { pin, line, view } = selection;
  const parts: [string, string | null][] = [
    ['p', pin && `${pin.x},${pin.y}`],
    ['l', line && [line.x0, line.y0, line.x1, line.y1, line.width].join(',')],
    ['a', selection.region && selection.region.join(',')],
    ['v', viewText(view)],
    ['m', selection.colours],
    ['r', rangeText(selection.range)],
    ['f', selection.frame === null ? null : String(selection.frame)],
    ['k', selection.frame === null ? null : selection.kind],
    ['cmp', selection.compare && encodeURIComponent(selection.compare)],
    ['s', selection.panel],
  ];
  const query = parts.flatMap(([key, text]) => (text === null ? [] : [`${key}=${text}`])).join('&');
  return `#results/${encodeURIComponent(selection.map ?? '')}${query ? `?${query}` : ''}`;
}

function numbers(text: string | null, count: number): number[] | null {
  const values = text ? text.split(',').map(Number) : [];
  return values.length === count && values.every(Number.isFinite) ? values : null;
}

function readRange(text: string | null): Range {
  if (text === 'f') return { mode: 'full' };
  const [low, high] = numbers(text, 2) ?? [];
  return low !== undefined && high !== undefined && low < high
    ? { mode: 'hand', low, high }
    : { mode: 'auto' };
}

function readView(text: string | null): Selection['view'] {
  if (text === 'all') return text;
  const [x, y, zoom] = numbers(text, 3) ?? [];
  return zoom !== undefined && zoom > 0 ? { x: x!, y: y!, zoom } : null;
}

const COLOURS: Colours[] = ['viridis', 'cividis', 'magma', 'grey', 'vik'];

/** Reads a fragment. What it does not understand is left out. */
export function fromHash(hash: string): Selection {
  const match = /^#results\/([^?]*)(?:\?(.*))?$/.exec(hash);
  if (!match) return NOTHING;
  const values = new URLSearchParams(match[2] ?? '');
  const pin = numbers(values.get('p'), 2)?.map(Math.round);
  const line = numbers(values.get('l'), 5);
  const region = numbers(values.get('a'), 4);
  const frame = numbers(values.get('f'), 1);
  const kind = values.get('k');
  return {
    map: decodeURIComponent(match[1] ?? '') || null,
    pin: pin ? { x: pin[0]!, y: pin[1]! } : null,
    line: line ? { x0: line[0]!, y0: line[1]!, x1: line[2]!, y1: line[3]!, width: line[4]! } : null,
    region: region ? [region[0]!, region[1]!, region[2]!, region[3]!] : null,
    view: readView(values.get('v')),
    colours: COLOURS.find((name) => name === values.get('m')) ?? null,
    range: readRange(values.get('r')),
    frame: frame ? Math.round(frame[0]!) : null,
    kind: kind === 'raw' || kind === 'rectified' ? kind : null,
    compare: values.get('cmp'),
    panel: values.get('s'),
  };
}
