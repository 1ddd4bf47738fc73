// Which part of the frame the pane shows, and what is asked of the server for it.

import type { Size, View } from '../map/view';

/** What the feed of pictures is asked for: a part of the frame in px, and how many values at most. */
export interface PictureWish {
  x: number;
  y: number;
  width: number;
  height: number;
  pixels: number;
  live: true;
}

export const MOST_VALUES = 600_000;

/** The part of the frame that is on the screen, in whole px, and the values that the pane can show. */
export function wishFor(view: View, canvas: Size, frame: Size, devicePixels: number): PictureWish {
  const half = { width: canvas.width / 2 / view.zoom, height: canvas.height / 2 / view.zoom };
  // At least one pixel is asked for, also beside the frame.
  const x = Math.min(Math.max(Math.floor(view.x - half.width), 0), frame.width - 1);
  const y = Math.min(Math.max(Math.floor(view.y - half.height), 0), frame.height - 1);
  const right = Math.min(Math.max(Math.ceil(view.x + half.width), x + 1), frame.width);
  const bottom = Math.min(Math.max(Math.ceil(view.y + half.height), y + 1), frame.height);
  const [width, height] = [right - x, bottom - y];
  const shown = width * height * (view.zoom * devicePixels) ** 2;
  // More values than pixels of the frame there are not.
  const pixels = Math.max(1, Math.min(MOST_VALUES, Math.ceil(shown), width * height));
  return { x, y, width, height, pixels, live: true };
}

/** One pixel of the frame on one pixel of the screen, with the point (x, y) of the canvas kept in place. */
export function oneToOne(view: View, canvas: Size, devicePixels: number, x: number, y: number): View {
  const zoom = 1 / devicePixels;
  const [dx, dy] = [x - canvas.width / 2, y - canvas.height / 2];
  return {
    x: view.x + dx / view.zoom - dx / zoom,
    y: view.y + dy / view.zoom - dy / zoom,
    zoom,
  };
}
