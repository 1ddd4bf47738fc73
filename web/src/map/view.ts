// Where the image lies on the screen. Image coordinates are continuous: pixel (3, 5) covers 3..4 by 5..6.

export interface View {
  /** Image coordinates at the centre of the canvas. */
  x: number;
  y: number;
  /** Screen px per image px. */
  zoom: number;
}

export interface Size {
  width: number;
  height: number;
}

export interface Pixel {
  x: number;
  y: number;
}

const GREATEST_ZOOM = 64;

/** The view that shows the whole image. */
export function fitted(image: Size, canvas: Size): View {
  const zoom = Math.min(canvas.width / image.width, canvas.height / image.height);
  return { x: image.width / 2, y: image.height / 2, zoom: zoom > 0 ? zoom : 1 };
}

/** Room around what is fitted, as a share of its size. */
const MARGIN = 0.04;

/** The view that shows a part of the image, or all of it if the part is nearly all, or unknown. */
export function fittedTo(
  part: [x0: number, y0: number, x1: number, y1: number] | null,
  image: Size,
  canvas: Size,
): View {
  const all = fitted(image, canvas);
  if (!part) return all;
  const [x0, y0, x1, y1] = part;
  const size = { width: (x1 - x0) * (1 + 2 * MARGIN), height: (y1 - y0) * (1 + 2 * MARGIN) };
  const { zoom } = fitted(size, canvas);
  if (zoom <= all.zoom) return all;
  return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, zoom: Math.min(zoom, GREATEST_ZOOM) };
}

export function toScreen(view: View, canvas: Size, x: number, y: number): { x: number; y: number } {
  return {
    x: (x - view.x) * view.zoom + canvas.width / 2,
    y: (y - view.y) * view.zoom + canvas.height / 2,
  };
}

export function toImage(view: View, canvas: Size, x: number, y: number): { x: number; y: number } {
  return {
    x: (x - canvas.width / 2) / view.zoom + view.x,
    y: (y - canvas.height / 2) / view.zoom + view.y,
  };
}

/** The pixel under a point of the screen; null beside the image. */
export function pixelAt(view: View, canvas: Size, image: Size, x: number, y: number): Pixel | null {
  const at = toImage(view, canvas, x, y);
  const pixel = { x: Math.floor(at.x), y: Math.floor(at.y) };
  const inside = pixel.x >= 0 && pixel.y >= 0 && pixel.x < image.width && pixel.y < image.height;
  return inside ? pixel : null;
}

/** Keeps some of the image in sight and the zoom within bounds. */
export function bounded(view: View, image: Size, canvas: Size): View {
  const least = Math.min(fitted(image, canvas).zoom / 2, 1);
  const zoom = Math.min(Math.max(view.zoom, least), GREATEST_ZOOM);
  return {
    x: Math.min(Math.max(view.x, 0), image.width),
    y: Math.min(Math.max(view.y, 0), image.height),
    zoom,
  };
}

/** Zooms by `factor` so that the image point under (x, y) of the screen stays there. */
export function zoomedAt(view: View, canvas: Size, factor: number, x: number, y: number): View {
  const at = toImage(view, canvas, x, y);
  const zoom = Math.min(view.zoom * factor, GREATEST_ZOOM);
  return {
    x: at.x - (x - canvas.width / 2) / zoom,
    y: at.y - (y - canvas.height / 2) / zoom,
    zoom,
  };
}

/** Moves the view just as far as is needed to show the pixel with a margin. */
export function showing(view: View, canvas: Size, pixel: Pixel): View {
  const margin = 24;
  const at = toScreen(view, canvas, pixel.x + 0.5, pixel.y + 0.5);
  const over = (position: number, length: number): number =>
    position < margin ? position - margin : position > length - margin ? position - length + margin : 0;
  return {
    ...view,
    x: view.x + over(at.x, canvas.width) / view.zoom,
    y: view.y + over(at.y, canvas.height) / view.zoom,
  };
}
