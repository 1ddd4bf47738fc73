// Profiles of several lines as curves of one plot.

import type { LineInfo, LinePoint } from '../api';
import type { Curve } from '../components/CurvePanel';

export interface Profiles {
  /** Distances along the lines in mm, in rising order: those of all of them. */
  x: number[];
  curves: Curve[];
  /** The points of the line with the cursors. */
  points: LinePoint[];
  /** Where in `x` each of them stands. */
  own: number[];
}

/** Dashes of the lines that stay: curves are told apart without colour. */
const DASHES = [
  [6, 3],
  [2, 3],
  [9, 3, 2, 3],
];

const near = (one: number, other: number): boolean =>
  Math.abs(one - other) <= 1e-9 * Math.max(one, other, 1);

/** All distances in rising order, each once. */
function allOf(distances: number[][]): number[] {
  const sorted = distances.flat().sort((one, other) => one - other);
  return sorted.filter((at, index) => index === 0 || !near(at, sorted[index - 1]!));
}

/** The index in `x` of each of the distances, all of which are there; both rise. */
function placesIn(x: number[], distances: number[]): number[] {
  let from = 0;
  return distances.map((at) => {
    while (from + 1 < x.length && !near(x[from]!, at)) from += 1;
    return from;
  });
}

/** Curves of `last` with its band of sigma, and of the `kept` lines; `factor` is the length that is shown over one in mm. */
export function profilesOf(last: LineInfo, kept: LineInfo[], names: string[], factor: number): Profiles {
  const distances = (info: LineInfo): number[] => info.points.map(({ distance_mm }) => distance_mm);
  const x = allOf([last, ...kept].map(distances));
  const own = placesIn(x, distances(last));
  const spread = (info: LineInfo, value: (point: LinePoint) => number | null): Curve['values'] => {
    const values = new Array<number | null | undefined>(x.length).fill(undefined);
    placesIn(x, distances(info)).forEach((place, index) => (values[place] = value(info.points[index]!)));
    return values;
  };
  const height = ({ height_mm }: LinePoint): number | null =>
    height_mm === null ? null : height_mm * factor;
  const shifted =
    (sign: number) =>
    ({ height_mm, sigma_mm }: LinePoint): number | null =>
      height_mm === null || sigma_mm === null ? null : (height_mm + sign * sigma_mm) * factor;
  const curves: Curve[] = [
    { label: 'value + sigma', values: spread(last, shifted(1)), tone: 'muted', width: 0.5 },
    { label: 'value − sigma', values: spread(last, shifted(-1)), tone: 'muted', width: 0.5 },
    ...kept.map((info, index): Curve => ({
      label: names[index]!,
      values: spread(info, height),
      tone: 'second',
      dash: DASHES[index % DASHES.length]!,
      width: 1.5,
    })),
    { label: names[kept.length]!, values: spread(last, height), tone: 'first', width: 1.8 },
  ];
  return { x, curves, points: last.points, own };
}
