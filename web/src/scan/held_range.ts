// The range of colours of the live map. A range that jumps between maps would hide that the map changes, so it
// is held, and grows. But the first maps are mostly noise: once the values fill less than half of the range, it
// is taken anew.

export interface HeldRange {
  low: number;
  high: number;
  /** Frames of the map by which it was last changed. */
  frames: number;
}

interface Bounds {
  low: number;
  high: number;
  frames: number;
}

/** The range of one map alone; never empty. */
export function fresh({ low, high, frames }: Bounds): HeldRange {
  return { low, high: high > low ? high : low + Math.max(Math.abs(low) * 1e-6, 1e-9), frames };
}

/** Share of the range that the values must fill. */
const FILLED = 0.5;

/** The held range, changed by another map if need be. */
export function heldBy(held: HeldRange | null, next: Bounds): HeldRange {
  if (!Number.isFinite(next.low) || !Number.isFinite(next.high))
    return held ?? fresh({ ...next, low: 0, high: 1 });
  if (!held) return fresh(next);
  if (next.high - next.low < FILLED * (held.high - held.low)) return fresh(next);
  if (next.low >= held.low && next.high <= held.high) return held;
  return {
    low: Math.min(held.low, next.low),
    high: Math.max(held.high, next.high),
    frames: next.frames,
  };
}

/** Shares of the values below and above the range; those without an answer do not count. */
export function clipped(values: Float32Array, low: number, high: number): { under: number; over: number } {
  let [under, over, all] = [0, 0, 0];
  for (const value of values) {
    if (!Number.isFinite(value)) continue;
    all += 1;
    if (value < low) under += 1;
    if (value > high) over += 1;
  }
  return all > 0 ? { under: under / all, over: over / all } : { under: 0, over: 0 };
}
