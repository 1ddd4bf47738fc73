// One unit of length per result, for values, sigma and axes: micrometres where the whole relief is small.

export interface LengthUnit {
  label: 'mm' | 'µm';
  /** Multiply millimetres by it. */
  factor: number;
}

export const MILLIMETRES: LengthUnit = { label: 'mm', factor: 1 };
export const MICROMETRES: LengthUnit = { label: 'µm', factor: 1000 };

/** Relief below a tenth of a millimetre is given in micrometres. */
export function lengthUnit(low_mm: number | null, high_mm: number | null): LengthUnit {
  if (low_mm === null || high_mm === null) return MILLIMETRES;
  return Math.max(Math.abs(low_mm), Math.abs(high_mm)) < 0.1 ? MICROMETRES : MILLIMETRES;
}

/** How values of a map's `unit` are shown: heights in the unit of the result, all else as it is. */
export function shownUnit(unit: string, lengths: LengthUnit): { label: string; factor: number } {
  return unit === 'mm' ? lengths : { label: unit, factor: 1 };
}
