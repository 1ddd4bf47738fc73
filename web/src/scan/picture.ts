// Pictures of the camera, as they come over the feed: a head, and samples row by row.

import type { PictureHead } from '../rig/api';

export interface LivePicture {
  head: PictureHead;
  /** DN, or 0 to 255 if samples have one byte. */
  samples: ArrayLike<number>;
  oneByte: boolean;
}

/** Takes a message apart. How many bytes a sample has follows from the length of the message. */
export function readPicture(buffer: ArrayBuffer): LivePicture {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length))) as PictureHead;
  const count = head.rows * head.columns;
  const rest = buffer.slice(4 + length);
  const each = Math.floor(rest.byteLength / count);
  if (each >= 4) return { head, samples: new Float32Array(rest, 0, count), oneByte: false };
  if (each >= 2) return { head, samples: new Uint16Array(rest, 0, count), oneByte: false };
  return { head, samples: new Uint8Array(rest), oneByte: true };
}

/** Draws it in greys, black at 0 and white at full scale, with corners that were found. */
export function drawPicture(
  canvas: HTMLCanvasElement,
  { head, samples, oneByte }: LivePicture,
  full_scale_dn: number,
  corners: [number, number][],
): void {
  const { rows, columns, bin } = head;
  if (canvas.width !== columns) canvas.width = columns;
  if (canvas.height !== rows) canvas.height = rows;
  const context = canvas.getContext('2d');
  if (!context) return;
  const image = context.createImageData(columns, rows);
  const factor = oneByte ? 1 : 255 / full_scale_dn;
  for (let index = 0; index < rows * columns; index += 1) {
    const grey = (samples[index] ?? 0) * factor;
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
