// What lies between two cursors of a profile.

import type { LinePoint } from '../api';

/** Two places of a profile, as distances along the line in mm. */
export type Cursors = [number, number];

export interface Between {
  /** Along the line, in mm. */
  dx_mm: number;
  /** Height of the second minus that of the first, in mm. */
  dz_mm: number;
  /** Its standard uncertainty if the errors of both heights are independent; null if one is not known. */
  sigma_mm: number | null;
  /** Null where both are at one place. */
  slope_deg: number | null;
}

/** Null where one of the points has no height. */
export function between(one: LinePoint, other: LinePoint): Between | null {
  if (one.height_mm === null || other.height_mm === null) return null;
  const dx_mm = other.distance_mm - one.distance_mm;
  const dz_mm = other.height_mm - one.height_mm;
  const known = one.sigma_mm !== null && other.sigma_mm !== null;
  return {
    dx_mm,
    dz_mm,
    sigma_mm: known ? Math.hypot(one.sigma_mm!, other.sigma_mm!) : null,
    slope_deg: dx_mm === 0 ? null : (Math.atan(dz_mm / dx_mm) * 180) / Math.PI,
  };
}

/** The index of the point that is nearest to a distance along the line; there is one at least. */
export function pointAt(points: LinePoint[], distance_mm: number): number {
  const off = (index: number): number => Math.abs(points[index]!.distance_mm - distance_mm);
  return points.reduce((best, _point, index) => (off(index) < off(best) ? index : best), 0);
}

/** The cursor that is nearer to a place goes there. */
export function moved([one, other]: Cursors, at: number): Cursors {
  return Math.abs(at - one) <= Math.abs(at - other) ? [at, other] : [one, at];
}

/** The cursors on a line with points at these distances, in rising order. */
export function within([one, other]: Cursors, distances: number[]): Cursors {
  const end = distances.at(-1) ?? 0;
  return [Math.min(one, end), Math.min(other, end)];
}
