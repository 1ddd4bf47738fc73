// Planes of the synthetic surface, found the plain way: by normal equations over all pixels.

import { codeAt, heightAt, PIXEL_MM, sigmaMmAt } from './truth';

type At = (x: number, y: number) => number;
type Region = [x0: number, y0: number, x1: number, y1: number];
type Three = [number, number, number];

/** Height = level + slopes times the way from the centre, all in px and mm. */
export interface Plane {
  centre: [x: number, y: number];
  level_mm: number;
  slopes: [x: number, y: number];
}

const determinant = (a: Three, b: Three, c: Three): number =>
  a[0] * (b[1] * c[2] - b[2] * c[1]) -
  a[1] * (b[0] * c[2] - b[2] * c[0]) +
  a[2] * (b[0] * c[1] - b[1] * c[0]);

/** The least-squares plane of pixels with heights, or null if there is none. */
function planeOf(pixels: [x: number, y: number, height: number][]): Plane | null {
  const mean = (index: 0 | 1): number => pixels.reduce((sum, one) => sum + one[index], 0) / pixels.length;
  const [x, y] = [mean(0), mean(1)];
  const sum = (of: (u: number, v: number, height: number) => number): number =>
    pixels.reduce((all, one) => all + of(one[0] - x, one[1] - y, one[2]), 0);
  const [n, u, v] = [pixels.length, sum((a) => a), sum((_a, b) => b)];
  const [uu, uv, vv] = [sum((a) => a * a), sum((a, b) => a * b), sum((_a, b) => b * b)];
  const [h, hu, hv] = [sum((_a, _b, c) => c), sum((a, _b, c) => a * c), sum((_a, b, c) => b * c)];
  const all = determinant([n, u, v], [u, uu, uv], [v, uv, vv]);
  if (pixels.length < 3 || Math.abs(all) < 1e-6) return null;
  return {
    centre: [x, y],
    level_mm: determinant([h, u, v], [hu, uu, uv], [hv, uv, vv]) / all,
    slopes: [
      determinant([n, h, v], [u, hu, uv], [v, hv, vv]) / all,
      determinant([n, u, h], [u, uu, hu], [v, uv, hv]) / all,
    ],
  };
}

const known = ([x, y]: [number, number]): boolean => codeAt(x, y) === 0;

function pixelsOf([x0, y0, x1, y1]: Region): [number, number][] {
  return Array.from({ length: (x1 - x0) * (y1 - y0) }, (_, index) => [
    x0 + (index % (x1 - x0)),
    y0 + Math.floor(index / (x1 - x0)),
  ]);
}

const planes = new Map<string, Plane | null>();

/** The plane that heights are levelled by, as the page says it. A point is one pixel here. */
export function planeBy(by: string): Plane | null {
  let plane = planes.get(by);
  if (plane === undefined) {
    const [kind, ...numbers] = by.split('-');
    const all = numbers.map(Number);
    const pixels: [number, number][] =
      kind === 'region'
        ? pixelsOf(all as Region)
        : [0, 2, 4].map((index) => [all[index]!, all[index + 1]!]);
    const there = pixels.filter(known);
    const enough = kind === 'region' || there.length === 3;
    plane = enough ? planeOf(there.map(([x, y]) => [x, y, heightAt(x, y)])) : null;
    planes.set(by, plane);
  }
  return plane;
}

/** The heights less the plane. */
export function levelledAt(by: string | null): At {
  const plane = by === null ? null : planeBy(by);
  if (!plane) return heightAt;
  const { centre, level_mm, slopes } = plane;
  return (x, y) => heightAt(x, y) - level_mm - slopes[0] * (x - centre[0]) - slopes[1] * (y - centre[1]);
}

/** A slope in mm of height a pixel as an angle in mrad. */
export const mrad = (slope: number): number => 1e3 * Math.atan(slope / PIXEL_MM);

/** A region in numbers, or null if its heights determine no plane. */
export function regionInNumbers(region: Region, by: string | null) {
  const at = levelledAt(by);
  const there = pixelsOf(region).filter(known);
  const plane = planeOf(there.map(([x, y]) => [x, y, at(x, y)]));
  if (!plane) return null;
  const rest = there.map(
    ([x, y]) =>
      at(x, y) -
      plane.level_mm -
      plane.slopes[0] * (x - plane.centre[0]) -
      plane.slopes[1] * (y - plane.centre[1]),
  );
  const mean = (of: (height: number) => number): number =>
    rest.reduce((sum, height) => sum + of(height), 0) / rest.length;
  const noise = Math.sqrt(there.reduce((sum, [x, y]) => sum + sigmaMmAt(x, y) ** 2, 0) / there.length);
  const sq = Math.sqrt(mean((height) => height * height));
  const lowest = rest.reduce((low, one) => Math.min(low, one), Infinity);
  const highest = rest.reduce((high, one) => Math.max(high, one), -Infinity);
  return {
    pixels: (region[2] - region[0]) * (region[3] - region[1]),
    mean_mm: plane.level_mm,
    mean_sigma_mm: sq / Math.sqrt(there.length / 100),
    tilt_x_mrad: mrad(plane.slopes[0]),
    tilt_x_sigma_mrad: 0.02,
    tilt_y_mrad: mrad(plane.slopes[1]),
    tilt_y_sigma_mrad: null,
    roughness: {
      sa_mm: mean(Math.abs),
      sq_mm: sq,
      sz_mm: highest - lowest,
      ssk: mean((height) => height ** 3) / sq ** 3,
      sku: mean((height) => height ** 4) / sq ** 4,
      sq_noise_mm: noise,
      sq_without_noise_mm: Math.sqrt(Math.max(sq * sq - noise * noise, 0)),
      pixels: there.length,
    },
  };
}
