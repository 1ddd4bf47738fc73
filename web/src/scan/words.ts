// Times, disk space and positions of a scan in words.

import { bytes, withMinus } from '../format/number';

/** Rounded as an estimate deserves: 10 s steps below 2 min, then minutes, then 5 min steps. */
export function duration(seconds: number): string {
  if (seconds < 115) return `about ${Math.max(Math.round(seconds / 10), 1) * 10} s`;
  if (seconds < 3570) return `about ${Math.round(seconds / 60)} min`;
  const minutes = Math.round(seconds / 300) * 5;
  const rest = minutes % 60;
  return `about ${Math.floor(minutes / 60)} h${rest > 0 ? ` ${rest} min` : ''}`;
}

/** The time left; negative seconds are those over the estimate. */
export function timeLeft(seconds: number | null): string {
  if (seconds === null) return 'time left not known yet';
  if (seconds >= 0) return `${duration(seconds)} left`;
  const over = Math.ceil(-seconds);
  return `over by ${Math.floor(over / 60)}:${String(over % 60).padStart(2, '0')}`;
}

export type DiskVerdict = 'good' | 'warning' | 'bad' | 'unknown';

/** Amber below 1.5 times what is needed, red below what is needed. */
export function diskVerdict(needs: number | null, free: number | null): DiskVerdict {
  if (needs === null || free === null) return 'unknown';
  if (free < needs) return 'bad';
  return free < 1.5 * needs ? 'warning' : 'good';
}

export const DISK_WORDS: Record<DiskVerdict, string> = {
  good: '\u2713 enough',
  warning: '! little room',
  bad: '\u2715 too little',
  unknown: '',
};

export function diskText(needs: number | null, free: number | null): string {
  const needed = needs === null ? 'need not known' : `needs ${bytes(needs)}`;
  return `${needed}, ${free === null ? 'free space not known' : `${bytes(free)} free`}`;
}

/** A position in mm to a micrometre. */
export function millimetres(mm: number): string {
  return withMinus(mm.toFixed(3));
}

/** Reported minus planned, in um with a sign. */
export function positionError(reported_mm: number, planned_mm: number): string {
  const um = (reported_mm - planned_mm) * 1000;
  const text = um.toFixed(1);
  if (Number(text) === 0) return '0.0 µm';
  return `${um > 0 ? '+' : ''}${withMinus(text)} µm`;
}

/** Two sigmas in px to the same place, so that they compare; the smaller has two digits. */
export function sigmaPair(now: number, before: number): [now: string, before: string] {
  const least = Math.min(now, before);
  const exponent = Number(least.toExponential(1).split('e')[1]);
  const places = Math.min(Math.max(1 - exponent, 0), 12);
  return [now.toFixed(places), before.toFixed(places)];
}

const HOLDERS: Record<string, string> = {
  operator: 'the operator',
  camera: 'the camera',
  stage: 'the stage',
  disk: 'the disk',
};

/** "the operator and the disk". */
export function holders(held_by: string[]): string {
  const names = held_by.map((name) => HOLDERS[name] ?? name);
  const last = names.pop();
  if (last === undefined) return 'nobody';
  return names.length > 0 ? `${names.join(', ')} and ${last}` : last;
}

export function plural(count: number, one: string, many = `${one}s`): string {
  return `${count} ${count === 1 ? one : many}`;
}
