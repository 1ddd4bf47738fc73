// A small picture of the camera.

import type { LivePicture } from '../rig/picture_message';

/** Draws it in greys, black at 0 and white at full scale, with corners that were found. */
export function drawPicture(
  canvas: HTMLCanvasElement,
  { head, bytes }: LivePicture,
  corners: [number, number][],
): void {
  const { rows, columns, bin } = head;
  if (canvas.width !== columns) canvas.width = columns;
  if (canvas.height !== rows) canvas.height = rows;
  const context = canvas.getContext('2d');
  if (!context) return;
  const image = context.createImageData(columns, rows);
  for (let index = 0; index < rows * columns; index += 1) {
    const grey = bytes[index] ?? 0;
    image.data[4 * index] = grey;
    image.data[4 * index + 1] = grey;
    image.data[4 * index + 2] = grey;
    image.data[4 * index + 3] = 255;
  }
  context.putImageData(image, 0, 0);
  const radius = Math.max(columns / 100, 2.5);
  // A white ring with a black edge is seen on every grey.
  for (const [style, width] of [
    ['#000', 3],
    ['#fff', 1.5],
  ] as const) {
    context.strokeStyle = style;
    context.lineWidth = width;
    for (const [x, y] of corners) {
      context.beginPath();
      context.arc((x + 0.5 - head.x) / bin, (y + 0.5 - head.y) / bin, radius, 0, 2 * Math.PI);
      context.stroke();
    }
  }
}
