// Positions on a colour bar, and the shares of values beyond its ends.

import type { Histogram } from '../api';

export type Scale = 'linear' | 'log';

/** Where a value lies between `low` and `high`, as 0 to 1 (beyond: less or more). */
export function positionOf(value: number, low: number, high: number, scale: Scale): number {
  if (scale === 'log' && low > 0) {
    return Math.log(Math.max(value, 1e-30) / low) / Math.log(high / low);
  }
  return (value - low) / (high - low);
}

/** The value at a position from 0 to 1. */
export function valueAt(position: number, low: number, high: number, scale: Scale): number {
  if (scale === 'log' && low > 0) return low * (high / low) ** position;
  return low + (high - low) * position;
}

/** Shares of the values below `low` and above `high`; within a bin values are taken as even. */
export function sharesBeyond(
  histogram: Histogram,
  low: number,
  high: number,
): { under: number; over: number } {
  const total = histogram.counts.reduce((sum, count) => sum + count, 0);
  if (total === 0) return { under: 0, over: 0 };
  const width = (histogram.high - histogram.low) / histogram.counts.length;
  const below = (limit: number): number =>
    histogram.counts.reduce((sum, count, bin) => {
      const inside =
        width > 0 ? (limit - (histogram.low + bin * width)) / width : limit > histogram.low ? 1 : 0;
      return sum + count * Math.min(Math.max(inside, 0), 1);
    }, 0);
  return { under: below(low) / total, over: 1 - below(high) / total };
}

/** The histogram of an array; values beyond are in the end bins, as in those of the server. */
export function histogramOf(values: ArrayLike<number>, low: number, high: number): Histogram {
  const counts = new Array<number>(256).fill(0);
  for (let index = 0; index < values.length; index += 1) {
    const value = values[index] ?? NaN;
    if (Number.isNaN(value)) continue;
    const bin = Math.min(Math.max(Math.floor(((value - low) / (high - low)) * 256), 0), 255);
    counts[bin] = (counts[bin] ?? 0) + 1;
  }
  return { low, high, counts };
}
