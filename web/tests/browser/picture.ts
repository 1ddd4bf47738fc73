// Pictures of a frame whose every pixel is known.

import type { PictureHead } from '../../src/rig/api';

export interface Wish {
  x: number;
  y: number;
  width: number;
  height: number;
  pixels: number;
}

export const FRAME = { rows: 480, columns: 640 };

/** The grey of a pixel of the frame: a board, and every pixel differs from its neighbours. */
export function greyAt(x: number, y: number): number {
  if (x >= 300 && x < 320 && y >= 200 && y < 220) return 255;
  if (x >= 100 && x < 110 && y >= 400 && y < 420) return 0;
  const [column, row] = [Math.floor((x - 160) / 38), Math.floor((y - 130) / 38)];
  const onBoard = column >= -1 && column < 9 && row >= -1 && row < 6;
  const board = onBoard && (column + row) % 2 === 0 ? 0 : 70;
  return 80 + board + ((x * 11 + y * 7) % 31);
}

/** A picture of what was wished, as the server makes it. */
export function pictureOf(wish: Wish, number: number, age_ms = 40): Buffer {
  let bin = 1;
  while (Math.ceil(wish.width / bin) * Math.ceil(wish.height / bin) > wish.pixels) bin += 1;
  const columns = Math.ceil(wish.width / bin);
  const rows = Math.ceil(wish.height / bin);
  const head: PictureHead = {
    number,
    x: wish.x,
    y: wish.y,
    bin,
    rows,
    columns,
    frame_rows: FRAME.rows,
    frame_columns: FRAME.columns,
    age_ms,
  };
  let text = JSON.stringify(head);
  while (Buffer.byteLength(text) % 4 !== 0) text += ' ';
  const values = Buffer.alloc(rows * columns);
  for (let row = 0; row < rows; row += 1) {
    for (let column = 0; column < columns; column += 1) {
      values[row * columns + column] = greyAt(wish.x + column * bin, wish.y + row * bin);
    }
  }
  const length = Buffer.alloc(4);
  length.writeUInt32LE(Buffer.byteLength(text));
  return Buffer.concat([length, Buffer.from(text), values]);
}
