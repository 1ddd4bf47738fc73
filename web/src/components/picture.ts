// Grey pictures with axes, for the EPI and for the costs of a row.

import { roundAbove, ticks, tickText } from '../map/scale_bar';
import type { Palette } from './palette';

export interface Frame {
  left: number;
  top: number;
  width: number;
  height: number;
}

export const MARGIN = { left: 54, top: 4, bottom: 36, right: 12 };

/** One axis: the value at the first row or column, the step to the next, and how many there are. */
export interface PictureAxis {
  first: number;
  step: number;
  count: number;
  label: string;
}

/** Where a value lies along an axis, from 0 to 1; values are at centres of pixels. */
export function along(axis: PictureAxis, value: number): number {
  return ((value - axis.first) / axis.step + 0.5) / axis.count;
}

/** Fits the canvas to its place on the page; returns the context and where the picture goes. */
export function prepare(
  canvas: HTMLCanvasElement,
  height: number,
): { context: CanvasRenderingContext2D; frame: Frame } {
  const devicePixels = Math.min(devicePixelRatio, 2);
  canvas.width = Math.round(canvas.clientWidth * devicePixels);
  canvas.height = Math.round((height + MARGIN.top + MARGIN.bottom) * devicePixels);
  const context = canvas.getContext('2d')!;
  context.scale(devicePixels, devicePixels);
  const width = Math.max(canvas.clientWidth - MARGIN.left - MARGIN.right, 50);
  return { context, frame: { left: MARGIN.left, top: MARGIN.top, width, height } };
}

/** Values as a canvas of the same size, black at `low`, white at `high`; what is not known is bluish. */
export function greyCanvas(
  values: ArrayLike<number>,
  rows: number,
  columns: number,
  low: number,
  high: number,
): HTMLCanvasElement {
  const canvas = document.createElement('canvas');
  canvas.width = columns;
  canvas.height = rows;
  const context = canvas.getContext('2d')!;
  const image = context.createImageData(columns, rows);
  for (let index = 0; index < rows * columns; index += 1) {
    const value = values[index] ?? NaN;
    const known = Number.isFinite(value);
    const grey = known ? ((value - low) / Math.max(high - low, 1e-6)) * 255 : 90;
    image.data.set([grey, grey, known ? grey : 110, 255], index * 4);
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

function eachTick(
  axis: PictureAxis,
  length: number,
  spacing: number,
  act: (at: number, text: string) => void,
): void {
  const last = axis.first + (axis.count - 1) * axis.step;
  const [low, high] = [Math.min(axis.first, last), Math.max(axis.first, last)];
  const least = (Math.abs(axis.step) * axis.count * spacing) / length;
  const step = roundAbove(least);
  for (const value of ticks(low, high, least)) act(along(axis, value) * length, tickText(value, step));
}

export function drawAxes(
  context: CanvasRenderingContext2D,
  frame: Frame,
  x: PictureAxis,
  y: PictureAxis,
  colours: Palette,
): void {
  const { left, top, width, height } = frame;
  context.fillStyle = colours.muted;
  context.font = '12px system-ui, sans-serif';
  context.textBaseline = 'top';
  context.textAlign = 'center';
  eachTick(x, width, 64, (at, text) => {
    context.fillRect(left + at, top + height, 1, 4);
    context.fillText(text, left + at, top + height + 6);
  });
  context.fillText(x.label, left + width / 2, top + height + 21);
  context.textAlign = 'right';
  context.textBaseline = 'middle';
  eachTick(y, height, 26, (at, text) => {
    context.fillRect(left - 4, top + at, 4, 1);
    context.fillText(text, left - 6, top + at);
  });
  context.save();
  context.translate(9, top + height / 2);
  context.rotate(-Math.PI / 2);
  context.textAlign = 'center';
  context.fillText(y.label, 0, 0);
  context.restore();
}

/** Strokes the path of `context` so that it is seen on black and on white. */
export function edged(
  context: CanvasRenderingContext2D,
  dash: number[],
  width: number,
  colour: string,
): void {
  context.setLineDash(dash);
  context.lineWidth = width + 2;
  context.strokeStyle = 'rgb(0 0 0 / 0.8)';
  context.stroke();
  context.lineWidth = width;
  context.strokeStyle = colour;
  context.stroke();
  context.setLineDash([]);
}
