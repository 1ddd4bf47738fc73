// Round lengths for the scale bar and for ticks of the axes.

/** The largest of 1, 2, 5 times a power of ten that is not above `most`. */
export function roundBelow(most: number): number {
  const power = 10 ** Math.floor(Math.log10(most));
  const factor = [5, 2, 1].find((candidate) => candidate * power <= most * (1 + 1e-9)) ?? 1;
  return factor * power;
}

/** The smallest of 1, 2, 5 times a power of ten that is not below `least`. */
export function roundAbove(least: number): number {
  const power = 10 ** Math.floor(Math.log10(least));
  const factor = [1, 2, 5].find((candidate) => candidate * power >= least * (1 - 1e-9)) ?? 10;
  return factor * power;
}

/** Ticks at round values within low..high, at least `spacing` apart (in the same unit). */
export function ticks(low: number, high: number, spacing: number): number[] {
  const step = roundAbove(spacing);
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: Math.max(last - first + 1, 0) }, (_, index) => (first + index) * step);
}

/** Text of a tick: as many places as its step needs. */
export function tickText(value: number, step: number): string {
  const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return value.toFixed(places).replace('-', '\u2212');
}
