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

/** By what heights are levelled: the least-squares plane of a region, or the plane through three points. */
export type Levelling = { region: Region } | { points: [Pin, Pin, Pin] };

export type Range = { mode: 'auto' } | { mode: 'full' } | { mode: 'hand'; low: number; high: number };

export interface Selection {
  map: string | null;
  pin: Pin | null;
  line: LineSelection | null;
  /** Lines that stay while others are drawn. */
  kept: LineSelection[];
  region: Region | null;
  level: Levelling | null;
  /** Where the map is looked at; null for what has answers. */
  view: View | 'all' | null;
  colours: Colours | null;
  range: Range;
  frame: number | null;
  kind: FrameKind | null;
  /** Other results of the same sequence, to compare with. */
  compare: string | null;
  /** Another sequence, to compare with. */
  compareSequence: string | null;
  panel: string | null;
  /** Whether heights are shown in 3-D. */
  solid: boolean;
}

/** Lines beside the one with the cursors: more could not be told apart. */
export const MOST_KEPT = 3;

export const NOTHING: Selection = {
  map: null,
  pin: null,
  line: null,
  kept: [],
  region: null,
  level: null,
  view: null,
  colours: null,
  range: { mode: 'auto' },
  frame: null,
  kind: null,
  compare: null,
  compareSequence: null,
  panel: null,
  solid: false,
};

function short(value: number, digits: number): string {
  return String(Number(value.toPrecision(digits)));
}

function rangeText(range: Range): string | null {
  if (range.mode === 'full') return 'f';
  return range.mode === 'hand' ? `${short(range.low, 6)},${short(range.high, 6)}` : null;
}

function lineText({ x0, y0, x1, y1, width }: LineSelection): string {
  return [x0, y0, x1, y1, width].join(',');
}

function readLine(text: string | null): LineSelection | null {
  const line = numbers(text, 5);
  return line && { x0: line[0]!, y0: line[1]!, x1: line[2]!, y1: line[3]!, width: line[4]! };
}

function viewText(view: Selection['view']): string | null {
  if (view === null || view === 'all') return view;
  return [short(view.x, 6), short(view.y, 6), short(view.zoom, 4)].join(',');
}

/** As the server reads it, too, which decodes nothing: no letter of it is ever encoded. */
export function levellingText(level: Levelling): string {
  return 'region' in level
    ? `region-${level.region.join('-')}`
    : `points-${level.points.map(({ x, y }) => `${x}-${y}`).join('-')}`;
}

/** The fragment of the address, with its `#`. */
export function toHash(selection: Selection): string {
  const { pin, line, view } = selection;
  const parts: [string, string | null][] = [
    ['p', pin && `${pin.x},${pin.y}`],
    ['l', line && lineText(line)],
    ['ls', selection.kept.map(lineText).join(';') || null],
    ['a', selection.region && selection.region.join(',')],
    ['lv', selection.level && levellingText(selection.level)],
    ['v', viewText(view)],
    ['m', selection.colours],
    ['r', rangeText(selection.range)],
    ['f', selection.frame === null ? null : String(selection.frame)],
    ['k', selection.frame === null ? null : selection.kind],
    ['cmp', selection.compare && encodeURIComponent(selection.compare)],
    ['cs', selection.compareSequence && encodeURIComponent(selection.compareSequence)],
    ['s', selection.panel],
    ['d', selection.solid ? '3' : null],
  ];
  const query = parts.flatMap(([key, text]) => (text === null ? [] : [`${key}=${text}`])).join('&');
  return `#results/${encodeURIComponent(selection.map ?? '')}${query ? `?${query}` : ''}`;
}

function numbers(text: string | null, count: number): number[] | null {
  const values = text ? text.split(',').map(Number) : [];
  return values.length === count && values.every(Number.isFinite) ? values : null;
}

function readLevelling(text: string | null): Levelling | null {
  const [, kind, rest] = /^(region|points)-(.*)$/.exec(text ?? '') ?? [];
  const all = numbers(rest?.replaceAll('-', ',') ?? null, kind === 'region' ? 4 : 6);
  if (!all) return null;
  const [a, b, c, d, e, f] = all.map(Math.round) as [number, number, number, number, number, number];
  return kind === 'region'
    ? { region: [a, b, c, d] }
    : {
        points: [
          { x: a, y: b },
          { x: c, y: d },
          { x: e, y: f },
        ],
      };
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
  const line = readLine(values.get('l'));
  const kept = (values.get('ls') ?? '').split(';').flatMap((text) => readLine(text) ?? []);
  const region = numbers(values.get('a'), 4);
  const frame = numbers(values.get('f'), 1);
  const kind = values.get('k');
  return {
    map: decodeURIComponent(match[1] ?? '') || null,
    pin: pin ? { x: pin[0]!, y: pin[1]! } : null,
    line,
    kept: line ? kept.slice(0, MOST_KEPT) : [],
    region: region ? [region[0]!, region[1]!, region[2]!, region[3]!] : null,
    level: readLevelling(values.get('lv')),
    view: readView(values.get('v')),
    colours: COLOURS.find((name) => name === values.get('m')) ?? null,
    range: readRange(values.get('r')),
    frame: frame ? Math.round(frame[0]!) : null,
    kind: kind === 'raw' || kind === 'rectified' ? kind : null,
    compare: values.get('cmp'),
    compareSequence: values.get('cs'),
    panel: values.get('s'),
    solid: values.get('d') === '3',
  };
}
