// What the map canvas shows at the moment: a map, a frame, or a difference, all in one shape.

import { computed } from '@preact/signals';
import type { Colours, Histogram, MapInfo } from '../api';
import { codesOf, type Code } from '../colours/codes';
import { histogramOf, type Scale } from '../colours/range';
import { comparison } from '../store/comparison';
import { isHeight, levelled } from '../store/levelled';
import { results } from '../store/results';
import { selection } from '../store/selection';
import { arraySource, frameSource, mapSource, type TileSource } from './source';

export interface Field {
  id: string;
  title: string;
  unit: string;
  colours: Colours;
  scale: Scale;
  /** Range of mode "auto" and of mode "full". */
  low: number;
  high: number;
  minimum: number;
  maximum: number;
  histogram: Histogram | null;
  codes: Code[] | null;
  source: TileSource;
  /** How the server is asked for a pixel of it; null for what is in the page alone. */
  asked: string | null;
  /** The value at a pixel of what is in the page alone. */
  local?: (x: number, y: number) => number | null;
  /** What the mode "auto" is called, and what else is to be said of it. */
  autoName: string;
  autoNote?: string;
}

/** A map, or its heights as they are levelled. */
function shownMap(map: MapInfo): Field {
  const held = levelled.value;
  const info = held?.infos.get(map.id);
  if (!held || !info) return ofMap(map);
  const plain = ofMap({ ...map, ...info });
  return {
    ...plain,
    title: `${map.title}, ${held.words}`,
    source: mapSource(map.id, map.levels, held.by),
    asked: `${plain.asked}&levelled_by=${held.by}`,
  };
}

function ofMap(map: MapInfo): Field {
  const log = map.scale === 'log';
  const minimum = map.minimum ?? 0;
  const maximum = map.maximum ?? 1;
  const least = log ? Math.max(minimum, maximum * 1e-6) : minimum;
  const low = map.low ?? least;
  const high = map.high ?? maximum;
  return {
    id: map.id,
    title: map.title,
    unit: map.unit,
    colours: map.colours,
    scale: map.scale,
    low: log ? Math.max(low, least) : low,
    high: high > low ? high : low + 1e-6,
    minimum: least,
    maximum: maximum > least ? maximum : least + 1e-6,
    histogram: map.histogram,
    codes: codesOf(map.classes),
    source: mapSource(map.id, map.levels),
    asked: `map=${encodeURIComponent(map.id)}`,
    autoName: 'auto',
    autoNote: map.widened ? '0.5\u201399.5 %, and connected areas beyond' : '0.5\u201399.5 %',
  };
}

function levelsOf(rows: number, columns: number): number {
  let levels = 1;
  while (Math.max(rows, columns) / 2 ** (levels - 1) > 256) levels += 1;
  return levels;
}

/** The frame `index`; null if there is none. */
export function frameField(index: number, kind: string): Field | null {
  const frames = results.value?.frames;
  if (!frames || index < 0 || index >= frames.count) return null;
  const full = 2 ** frames.bit_depth - 1;
  return {
    id: 'frame',
    title: `Frame ${index} (${kind})`,
    unit: 'DN',
    colours: 'grey',
    scale: 'linear',
    // All that a camera can tell: no frame has values beyond, and frames compare.
    low: 0,
    high: full,
    minimum: 0,
    maximum: full,
    histogram: null,
    codes: null,
    source: frameSource(index, kind, levelsOf(frames.rows, frames.columns)),
    asked: `frame=${index}&kind=${kind}`,
    autoName: 'full scale',
  };
}

function differenceField(inSigma: boolean): Field | null {
  const held = comparison.value;
  if (!held) return null;
  const values = inSigma ? held.inSigma : held.difference;
  const sizes = values.filter(Number.isFinite).map(Math.abs).sort();
  const greatest = sizes[sizes.length - 1] ?? 1;
  const high = inSigma ? 3 : (sizes[Math.floor(sizes.length * 0.99)] ?? 1) || 1e-6;
  const name = inSigma ? 'difference-sigma' : 'difference';
  const step = held.info.step ?? Math.ceil((results.value?.frames.columns ?? 1) / held.info.columns);
  // Each of its values is the mean of so many pixels.
  const means = step > 1 ? `, means of ${step} × ${step} px` : '';
  const title = inSigma
    ? `Difference / sigma, to ${held.other}${means}`
    : `Difference of ${held.map} to ${held.other}${means}`;
  return {
    id: name,
    title,
    unit: inSigma ? '' : held.info.unit,
    colours: 'vik',
    scale: 'linear',
    low: -high,
    high,
    minimum: -greatest,
    maximum: greatest,
    histogram: histogramOf(values, -1.5 * high, 1.5 * high),
    codes: null,
    source: arraySource(`${name}/${held.other}/${held.map}`, values, held.info.columns, step),
    asked: null,
    local: (x, y) => {
      const value = values[Math.floor(y / step) * held.info.columns + Math.floor(x / step)] ?? NaN;
      return Number.isFinite(value) ? value : null;
    },
    autoName: 'auto',
    autoNote: inSigma ? '\u00b13 sigma' : '99 %, about zero',
  };
}

const difference = computed(() => differenceField(false));
const differenceInSigma = computed(() => differenceField(true));

export const field = computed<Field | null>(() => {
  const { frame, kind, map } = selection.value;
  const held = results.value;
  if (!held) return null;
  if (frame !== null) return frameField(frame, kind ?? held.frames.matched);
  if (map === 'difference') return difference.value;
  if (map === 'difference-sigma') return differenceInSigma.value;
  const info = held.maps.find((one) => one.id === map);
  return info ? shownMap(info) : null;
});

/** Whether the surface is shown in 3-D: only heights are. */
export const inSolid = computed(() => {
  const { solid, frame, map } = selection.value;
  return solid && frame === null && map !== null && isHeight(map) && !!results.value?.geometry;
});

/** The colours that are shown: those chosen, or those of the field. */
export const shownColours = computed<Colours>(
  () => selection.value.colours ?? field.value?.colours ?? 'viridis',
);

/** The range that is shown. */
export const shownRange = computed<{ low: number; high: number }>(() => {
  const { range } = selection.value;
  const held = field.value;
  if (range.mode === 'hand') return { low: range.low, high: range.high };
  if (!held) return { low: 0, high: 1 };
  return range.mode === 'full'
    ? { low: held.minimum, high: held.maximum }
    : { low: held.low, high: held.high };
});
