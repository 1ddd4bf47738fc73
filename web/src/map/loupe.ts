// A magnified view beside the finger that moves the pin, since the finger hides it.

import type { Marks } from './marks';

const SIDE = 120;
const FACTOR = 4;

/** Call it right after the map was drawn: its pixels are gone later. */
export function drawLoupe(
  context: CanvasRenderingContext2D,
  map: HTMLCanvasElement,
  at: { x: number; y: number },
  { gutter, canvas }: Marks,
  devicePixels: number,
): void {
  const part = (SIDE / FACTOR) * devicePixels;
  const left = at.x < canvas.width / 2 ? canvas.width - SIDE - 8 : 8;
  const [x, y] = [gutter.left + left, gutter.top + 8];
  context.save();
  context.imageSmoothingEnabled = false;
  context.fillStyle = '#3a424b';
  context.fillRect(x, y, SIDE, SIDE);
  const [fromX, fromY] = [at.x * devicePixels - part / 2, at.y * devicePixels - part / 2];
  context.drawImage(map, fromX, fromY, part, part, x, y, SIDE, SIDE);
  context.lineWidth = 3;
  context.strokeStyle = '#fff';
  context.strokeRect(x, y, SIDE, SIDE);
  context.lineWidth = 1;
  context.strokeStyle = '#000';
  context.strokeRect(x, y, SIDE, SIDE);
  context.strokeRect(x + SIDE / 2 - FACTOR / 2, y + SIDE / 2 - FACTOR / 2, FACTOR, FACTOR);
  context.restore();
}
