// Which tiles a view needs. Level k holds means of 2^k x 2^k pixels; a tile holds 256 x 256 of them.

import { toImage, type Size, type View } from './view';

export const TILE = 256;

export interface Window {
  level: number;
  /** First tile row and column, and how many. */
  row: number;
  column: number;
  rows: number;
  columns: number;
}

/** The level whose values are about as large as the px of the screen. */
export function levelFor(zoom: number, devicePixels: number, levels: number): number {
  return Math.min(Math.max(Math.round(-Math.log2(zoom * devicePixels)), 0), levels - 1);
}

/** The tiles of `level` that the canvas shows. */
export function windowFor(view: View, canvas: Size, image: Size, level: number): Window {
  const side = TILE * 2 ** level;
  const first = toImage(view, canvas, 0, 0);
  const last = toImage(view, canvas, canvas.width, canvas.height);
  const range = (low: number, high: number, length: number): [number, number] => {
    const tiles = Math.max(Math.ceil(length / side), 1);
    const begin = Math.min(Math.max(Math.floor(low / side), 0), tiles - 1);
    const end = Math.min(Math.max(Math.floor(high / side), begin), tiles - 1);
    return [begin, end - begin + 1];
  };
  const [row, rows] = range(first.y, last.y, image.height);
  const [column, columns] = range(first.x, last.x, image.width);
  return { level, row, column, rows, columns };
}

/** All tiles of the first level that is small enough to be loaded before the rest. */
export function coarseWindow(image: Size, levels: number): Window {
  const longest = Math.max(image.width, image.height);
  const level = Math.min(Math.max(Math.ceil(Math.log2(longest / (2 * TILE))), 0), levels - 1);
  const side = TILE * 2 ** level;
  return {
    level,
    row: 0,
    column: 0,
    rows: Math.max(Math.ceil(image.height / side), 1),
    columns: Math.max(Math.ceil(image.width / side), 1),
  };
}

export function sameWindow(one: Window, other: Window): boolean {
  return (
    one.level === other.level &&
    one.row === other.row &&
    one.column === other.column &&
    one.rows === other.rows &&
    one.columns === other.columns
  );
}
