// A synthetic surface whose every number is known, for tests of the page.

export const COLUMNS = 640;
export const ROWS = 480;
export const FRAMES = 41;
export const REFERENCE = 20;
export const PIXEL_MM = 0.025;
/** Disparity of height 0, and px per mm of height. */
export const DISPARITY_PX = 20;
export const PX_PER_MM = 6;
export const DEPTH_MM = 0.2;

/** Position of frame t relative to the reference, in parts of the baseline. */
export const TAU = Array.from({ length: FRAMES }, (_, t) => (t - REFERENCE) / (FRAMES - 1));

/** What the codes of the map `mask` stand for. */
export const ANSWERS = [
  'answered',
  'leaves the image',
  'beyond the range',
  'too uncertain',
  'occluded',
  'ambiguous',
];

/** Codes as in the map `mask`. */
export function codeAt(x: number, y: number): number {
  if (x >= 616) return 1;
  if (Math.hypot(x - 520, y - 380) < 40) return 3;
  if (x >= 380 && x < 386 && y >= 90 && y < 210) return 4;
  if (x >= 60 && x < 90 && y >= 380 && y < 400) return 5;
  return 0;
}

function hollow(x: number, y: number): boolean {
  return Math.hypot(x - 180, y - 160) < 70 || (x >= 386 && x < 520 && y >= 90 && y < 210);
}

/** A repeatable number from -1 to 1. */
export function noise(x: number, y: number): number {
  const value = Math.sin(x * 127.1 + y * 311.7) * 43758.5453;
  return (value - Math.floor(value)) * 2 - 1;
}

export function sigmaMmAt(x: number, y: number): number {
  return (
    0.001 * (1 + 3 * Math.exp(-(((x - 320) / 120) ** 2) - ((y - 420) / 60) ** 2)) * (1 + 0.2 * noise(y, x))
  );
}

/** The height that the results hold: truth and a little noise. */
export function heightAt(x: number, y: number): number {
  const ripple = 0.03 * Math.sin(x / 40) * Math.cos(y / 55);
  const peak = Math.hypot(x - 300, y - 60) < 4 ? 0.35 : 0;
  return ripple - (hollow(x, y) ? DEPTH_MM : 0) + peak + 0.5 * sigmaMmAt(x, y) * noise(x, y);
}

export function disparityAt(x: number, y: number): number {
  return DISPARITY_PX + PX_PER_MM * heightAt(x, y);
}

export function sigmaPxAt(x: number, y: number): number {
  return sigmaMmAt(x, y) * PX_PER_MM;
}

function textureAt(x: number, y: number): number {
  const waves =
    Math.sin(x * 0.9 + 1.7 * Math.sin(y * 0.31)) +
    Math.sin(x * 0.37 + y * 0.71) +
    Math.sin(x * 0.19 - y * 0.23 + 2 * Math.sin(x * 0.05));
  return 1800 + 420 * waves;
}

/** Intensity in DN of frame t at a point; the texture moves with the disparity. */
export function frameAt(t: number, x: number, y: number): number {
  const height = codeAt(Math.round(x), y) === 3 ? 0 : heightAt(Math.round(x), y);
  const at = x - (DISPARITY_PX + PX_PER_MM * height) * (TAU[t] ?? 0);
  const plain = Math.hypot(at - 520, y - 380) < 40;
  return (plain ? 1800 : textureAt(at, y)) + 15 * noise(x + 31 * t, y);
}

export interface MapTruth {
  id: string;
  title: string;
  unit: string;
  colours: string;
  scale: string;
  nearest: boolean;
  at: (x: number, y: number) => number;
}

const found =
  (value: (x: number, y: number) => number) =>
  (x: number, y: number): number =>
    codeAt(x, y) === 0 ? value(x, y) : NaN;

export const MAPS: MapTruth[] = [
  {
    id: 'height',
    title: 'Height',
    unit: 'mm',
    colours: 'viridis',
    scale: 'linear',
    nearest: false,
    at: found(heightAt),
  },
  {
    id: 'height-sigma',
    title: 'Standard uncertainty of the height',
    unit: 'mm',
    colours: 'magma',
    scale: 'log',
    nearest: false,
    at: found(sigmaMmAt),
  },
  {
    id: 'disparity',
    title: 'Disparity',
    unit: 'px',
    colours: 'viridis',
    scale: 'linear',
    nearest: false,
    at: found(disparityAt),
  },
  {
    id: 'sigma',
    title: 'Standard uncertainty of the disparity',
    unit: 'px',
    colours: 'magma',
    scale: 'log',
    nearest: false,
    at: found(sigmaPxAt),
  },
  {
    id: 'mask',
    title: 'Answers of the matcher',
    unit: '',
    colours: 'mask',
    scale: 'linear',
    nearest: true,
    at: codeAt,
  },
];
