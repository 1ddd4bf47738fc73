// A picture as canvases of its own size: its greys, and masks of what is saturated, dark, sharp.

import type { LivePicture } from './picture_message';

export interface Layers {
  grey: HTMLCanvasElement;
  saturated: HTMLCanvasElement | null;
  dark: HTMLCanvasElement | null;
  sharp: HTMLCanvasElement | null;
}

/** Opaque greys as the bytes of ImageData, read as one number each. */
const GREYS = Uint32Array.from({ length: 256 }, (_, grey) => (0xff000000 | (grey * 0x010101)) >>> 0);
const OPAQUE = 0xffffffff;
/** A step of brightness to the next value that counts as an edge. */
const EDGE = 40;

function canvasOf(
  { rows, columns }: { rows: number; columns: number },
  fill: (pixels: Uint32Array) => boolean,
): HTMLCanvasElement | null {
  const image = new ImageData(columns, rows);
  if (!fill(new Uint32Array(image.data.buffer))) return null;
  const canvas = document.createElement('canvas');
  canvas.width = columns;
  canvas.height = rows;
  canvas.getContext('2d')!.putImageData(image, 0, 0);
  return canvas;
}

/** A mask of the values that equal `wanted`; null if there are none. */
function maskOf({ head, bytes }: LivePicture, wanted: number): HTMLCanvasElement | null {
  if (!bytes.includes(wanted)) return null;
  return canvasOf(head, (pixels) => {
    for (let index = 0; index < bytes.length; index += 1)
      if (bytes[index] === wanted) pixels[index] = OPAQUE;
    return true;
  });
}

function edgesOf({ head, bytes }: LivePicture): HTMLCanvasElement | null {
  const { rows, columns } = head;
  return canvasOf(head, (pixels) => {
    let found = false;
    for (let row = 0; row + 1 < rows; row += 1) {
      for (let index = row * columns; index + 1 < (row + 1) * columns; index += 1) {
        const here = bytes[index]!;
        const step = Math.abs(bytes[index + 1]! - here) + Math.abs(bytes[index + columns]! - here);
        if (step < EDGE) continue;
        pixels[index] = OPAQUE;
        found = true;
      }
    }
    return found;
  });
}

export function layersOf(picture: LivePicture, wanted: { zebra: boolean; peaking: boolean }): Layers {
  const { head, bytes } = picture;
  const grey = canvasOf(head, (pixels) => {
    for (let index = 0; index < bytes.length; index += 1) pixels[index] = GREYS[bytes[index]!]!;
    return true;
  });
  return {
    grey: grey!,
    saturated: wanted.zebra ? maskOf(picture, 255) : null,
    dark: wanted.zebra ? maskOf(picture, 0) : null,
    sharp: wanted.peaking ? edgesOf(picture) : null,
  };
}
