// Where the parts of a control chart lie, and what is said of it.

import { valueAndSigma } from '../format/number';
import { roundAbove, ticks, tickText } from '../map/scale_bar';
import type { SeriesChart, SeriesPoint } from '../types';

/** Intervals are drawn with this coverage factor: about 95 %. */
const COVERAGE = 2;

/** Intervals and tolerances may make the chart this many times as high as its values need; beyond, they are cut. */
const MOST_WIDENED = 3;

export const MARGINS = { left: 66, right: 48, top: 10, bottom: 40 };

export interface Tick {
  at: number;
  text: string;
}

export interface Layout {
  /** Place of the value with this number. */
  x: (index: number) => number;
  y: (value: number) => number;
  /** Number of the value that is nearest to a place. */
  nearest: (x: number) => number;
  rows: Tick[];
  columns: Tick[];
}

/** Half of the interval of a value. */
export function halfOf({ sigma }: SeriesPoint): number | null {
  return sigma === null ? null : COVERAGE * sigma;
}

/** The range of the values with the limits of control, and with intervals and tolerance as far as there is room. */
export function rangeOf(chart: SeriesChart): [low: number, high: number] {
  const { points, lower, upper, lower_limit, upper_limit } = chart;
  let [low, high] = [lower, upper];
  for (const { value } of points) [low, high] = [Math.min(low, value), Math.max(high, value)];
  const most = MOST_WIDENED * (high - low);
  const ends = points.flatMap((point) => {
    const half = halfOf(point);
    return half === null ? [] : [point.value - half, point.value + half];
  });
  const limits = [lower_limit, upper_limit].filter((limit) => limit !== null);
  for (const more of [ends, limits]) {
    const wider = more.reduce<[number, number]>(
      ([least, greatest], one) => [Math.min(least, one), Math.max(greatest, one)],
      [low, high],
    );
    if (wider[1] - wider[0] <= most) [low, high] = wider;
  }
  // Equal values lie in the middle of a small range.
  const room = high > low ? 0.06 * (high - low) : Math.max(Math.abs(high) * 1e-3, 1e-9);
  return [low - room, high + room];
}

/** Lays out a chart on so many pixels. */
export function layoutOf(chart: SeriesChart, width: number, height: number): Layout {
  const count = chart.points.length;
  const [low, high] = rangeOf(chart);
  const across = Math.max(width - MARGINS.left - MARGINS.right, 1);
  const down = Math.max(height - MARGINS.top - MARGINS.bottom, 1);
  const x = (index: number): number => MARGINS.left + ((index + 0.5) / count) * across;
  const y = (value: number): number => MARGINS.top + ((high - value) / (high - low)) * down;
  const spacing = ((high - low) / down) * 34;
  const each = Math.max((count / across) * 56, 1);
  return {
    x,
    y,
    nearest: (at) => Math.min(Math.max(Math.floor(((at - MARGINS.left) / across) * count), 0), count - 1),
    rows: ticks(low, high, spacing).map((value) => ({
      at: y(value),
      text: tickText(value, roundAbove(spacing)),
    })),
    columns: ticks(1, count, each).map((number) => ({ at: x(number - 1), text: String(number) })),
  };
}

/** The unit as people write it. */
export function unitOf({ unit }: SeriesChart): string {
  return unit === 'um' ? 'µm' : unit;
}

/** A value of the chart, to two digits of the scatter, with its unit. */
export function valueText(chart: SeriesChart, value: number): string {
  const unit = unitOf(chart);
  return `${valueAndSigma(value, chart.scatter).value}${unit ? ` ${unit}` : ''}`;
}

/** Where the mean has changed, in a sentence; null if that may be chance. */
export function changeText(chart: SeriesChart): string | null {
  const { change, points } = chart;
  if (!change) return null;
  const name = (index: number): string => points[index]?.sequence ?? '';
  const by = change.after - change.before;
  const range =
    change.earliest === change.latest
      ? ''
      : ` (between ${name(change.earliest)} and ${name(change.latest)})`;
  return `The mean has changed by ${by > 0 ? '+' : ''}${valueText(chart, by)} at ${name(change.first)}${range}.`;
}
