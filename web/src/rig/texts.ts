// Numbers of the rig as people read them.

import { significant, withMinus } from '../format/number';

/** Decimal places that a length needs to be told apart from its neighbours at this step. */
function placesOf(step: number): number {
  return Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
}

/** Digits of a position: one more than the smallest step button has. */
export function positionPlaces(steps_mm: readonly number[]): number {
  const least = Math.min(...steps_mm.filter((step) => step > 0));
  return Number.isFinite(least) ? Math.min(Math.max(placesOf(least) + 1, 2), 6) : 3;
}

/** `12.345 mm`, with a real minus. */
export function positionText(mm: number, steps_mm: readonly number[]): string {
  return `${withMinus(mm.toFixed(positionPlaces(steps_mm)))} mm`;
}

/** `+0.01`, as on a step button. */
export function stepText(mm: number): string {
  return `${mm < 0 ? '\u2212' : '+'}${stepSize(mm)}`;
}

/** `0.01`: as many digits as the step has. */
export function stepSize(mm: number): string {
  return String(Number(Math.abs(mm).toPrecision(6)));
}

/** The age of a picture: `61 ms`, `2.4 s`, `3 min`. */
export function ageText(ms: number): string {
  if (ms < 1000) return `${Math.round(ms)} ms`;
  if (ms < 99_500) return `${(ms / 1000).toFixed(ms < 9950 ? 1 : 0)} s`;
  return `${Math.round(ms / 60_000)} min`;
}

export type Freshness = 'live' | 'old' | 'stale';

export function freshness(ms: number): Freshness {
  return ms > 2000 ? 'stale' : ms > 500 ? 'old' : 'live';
}

/** A share of all pixels as per cent; single pixels of a large picture still show. */
export function shareText(part: number, all: number): string {
  if (part <= 0 || all <= 0) return '0 %';
  if (part >= all) return '100 %';
  const value = (part / all) * 100;
  if (value < 0.0001) return '< 0.0001 %';
  if (value >= 99.5) return '> 99.5 %';
  return `${significant(value, 2)} %`;
}

/** Exposure in the unit that people use for it. */
export function exposureText(us: number): string {
  return us < 1000 ? `${significant(us, 3)} µs` : `${significant(us / 1000, 4)} ms`;
}

/** `about 4 min left`, `about 50 s left`, `over by 0:40`. */
export function timeLeftText(seconds: number): string {
  if (seconds < 0) {
    const over = Math.round(-seconds);
    return `over by ${Math.floor(over / 60)}:${String(over % 60).padStart(2, '0')}`;
  }
  if (seconds < 10) return 'a few seconds left';
  if (seconds < 120) return `about ${Math.round(seconds / 10) * 10} s left`;
  if (seconds < 5400) return `about ${Math.round(seconds / 60)} min left`;
  return `about ${significant(seconds / 3600, 2)} h left`;
}

/** Gigabytes on a disk: whole from ten on. */
export function diskText(bytes: number): string {
  const size = bytes / 1e9;
  return `${size < 10 ? size.toFixed(1) : Math.round(size)} GB`;
}

/** The unit in which a control is shown, and the counts of the control in one of it. */
export function unitOf(name: string): { unit?: string; counts: number } {
  // V4L2 counts an exposure in parts of 100 us.
  return /^exposure(_time)?_absolute$/.test(name) ? { unit: 'ms', counts: 10 } : { counts: 1 };
}

/** The value of a control, in its unit. */
export function valueText(name: string, value: number): string {
  const { unit, counts } = unitOf(name);
  return unit ? `${value / counts} ${unit}` : withMinus(String(value));
}

/** A name of a driver, such as `auto_exposure`, as words. */
export function titleOf(name: string): string {
  if (/^exposure(_time)?(_absolute)?$/.test(name)) return 'Exposure';
  const words = name.replaceAll('_', ' ').trim();
  return words.charAt(0).toUpperCase() + words.slice(1);
}
