// What lies over the map: pin, hover, line, region, axes, scale bar. Drawn on a canvas of its own.

import type { Palette } from '../components/palette';
import type { LineSelection, Pin, Region } from '../store/hash';
import { lettersOf } from '../store/selection';
import { roundAbove, roundBelow, ticks, tickText } from './scale_bar';
import { toImage, toScreen, type Size, type View } from './view';

/** Room for the axes around the map, in px of the page. */
export interface Gutter {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

export interface Marks {
  view: View;
  canvas: Size;
  gutter: Gutter;
  image: Size;
  pixel_mm: number | null;
  /** The pixel at 0 mm; null if it is unknown, and then there are no axes in mm. */
  origin_px: [x: number, y: number] | null;
  palette: Palette;
  pin: Pin | null;
  hover: Pin | null;
  /** In the order of their letters. */
  lines: LineSelection[];
  region: Region | null;
  /** What heights are levelled by, or will be. */
  level: { region: Region | null; points: Pin[] };
}

type Context = CanvasRenderingContext2D;

/** A white line with a black edge is seen on every colour. */
function stroke(context: Context, dash: number[] = []): void {
  context.setLineDash(dash);
  context.lineWidth = 4;
  context.strokeStyle = 'rgb(0 0 0 / 0.85)';
  context.stroke();
  context.lineWidth = 1.5;
  context.strokeStyle = '#fff';
  context.stroke();
  context.setLineDash([]);
}

function edgedText(context: Context, text: string, x: number, y: number): void {
  context.lineWidth = 3.5;
  context.lineJoin = 'round';
  context.strokeStyle = 'rgb(0 0 0 / 0.85)';
  context.strokeText(text, x, y);
  context.fillStyle = '#fff';
  context.fillText(text, x, y);
}

/** The cross is open, so that its pixel stays in sight. */
function cross(context: Context, { view, canvas }: Marks, at: Pin, arm: number, dash: number[]): void {
  const centre = toScreen(view, canvas, at.x + 0.5, at.y + 0.5);
  const gap = Math.max(5, view.zoom / 2 + 2);
  context.beginPath();
  for (const [dx, dy] of [
    [1, 0],
    [-1, 0],
    [0, 1],
    [0, -1],
  ] as const) {
    context.moveTo(centre.x + dx * gap, centre.y + dy * gap);
    context.lineTo(centre.x + dx * (gap + arm), centre.y + dy * (gap + arm));
  }
  stroke(context, dash);
  if (view.zoom < 6) return;
  const corner = toScreen(view, canvas, at.x, at.y);
  context.beginPath();
  context.rect(corner.x, corner.y, view.zoom, view.zoom);
  stroke(context, dash);
}

function drawLine(
  context: Context,
  { view, canvas }: Marks,
  line: LineSelection,
  [first, last]: [string, string],
): void {
  const from = toScreen(view, canvas, line.x0 + 0.5, line.y0 + 0.5);
  const to = toScreen(view, canvas, line.x1 + 0.5, line.y1 + 0.5);
  context.beginPath();
  context.moveTo(from.x, from.y);
  context.lineTo(to.x, to.y);
  stroke(context);
  const length = Math.hypot(to.x - from.x, to.y - from.y) || 1;
  const half = Math.max((line.width * view.zoom) / 2, 4);
  const [nx, ny] = [(-(to.y - from.y) / length) * half, ((to.x - from.x) / length) * half];
  context.beginPath();
  for (const end of [from, to]) {
    context.moveTo(end.x - nx, end.y - ny);
    context.lineTo(end.x + nx, end.y + ny);
  }
  stroke(context);
  context.font = '600 14px system-ui, sans-serif';
  const [ux, uy] = [(to.x - from.x) / length, (to.y - from.y) / length];
  context.textAlign = 'center';
  context.textBaseline = 'middle';
  edgedText(context, first, from.x - ux * 14, from.y - uy * 14);
  edgedText(context, last, to.x + ux * 14, to.y + uy * 14);
}

/** Points of a plane, numbered from 1; its region. */
function drawLevel(context: Context, marks: Marks): void {
  const { region, points } = marks.level;
  if (region) drawRegion(context, marks, region, [2, 4]);
  context.font = '600 14px system-ui, sans-serif';
  context.textAlign = 'left';
  context.textBaseline = 'bottom';
  points.forEach((point, index) => {
    const at = toScreen(marks.view, marks.canvas, point.x + 0.5, point.y + 0.5);
    context.beginPath();
    context.arc(at.x, at.y, 5, 0, 2 * Math.PI);
    stroke(context);
    edgedText(context, String(index + 1), at.x + 7, at.y - 5);
  });
}

function drawRegion(context: Context, { view, canvas }: Marks, region: Region, dash: number[]): void {
  const from = toScreen(view, canvas, Math.min(region[0], region[2]), Math.min(region[1], region[3]));
  const to = toScreen(view, canvas, Math.max(region[0], region[2]), Math.max(region[1], region[3]));
  context.beginPath();
  context.rect(from.x, from.y, to.x - from.x, to.y - from.y);
  stroke(context, dash);
}

function scaleBar(context: Context, { view, canvas, image, pixel_mm }: Marks): void {
  const unit_px = pixel_mm === null ? 1 : 1 / pixel_mm;
  const length = roundBelow(Math.min(140, canvas.width / 4) / view.zoom / unit_px);
  const width = length * unit_px * view.zoom;
  // It lies on the image, where there is one.
  const left = toScreen(view, canvas, 0, 0).x;
  const bottom = toScreen(view, canvas, 0, image.height).y;
  const x = Math.min(Math.max(left, 0), canvas.width / 2) + 14;
  const y = Math.min(Math.max(bottom, canvas.height / 2), canvas.height) - 14;
  context.beginPath();
  context.moveTo(x, y - 5);
  context.lineTo(x, y + 5);
  context.moveTo(x, y);
  context.lineTo(x + width, y);
  context.moveTo(x + width, y - 5);
  context.lineTo(x + width, y + 5);
  stroke(context);
  context.font = '600 13px system-ui, sans-serif';
  context.textAlign = 'left';
  context.textBaseline = 'bottom';
  const text = pixel_mm === null ? `${tickText(length, length)} px` : `${tickText(length, length)} mm`;
  edgedText(context, text, x + 4, y - 6);
}

/** Ticks along one side: px on the left and below, mm on the right and above. */
function axis(context: Context, marks: Marks, side: 'left' | 'bottom' | 'top' | 'right'): void {
  const { view, canvas, gutter, image, palette } = marks;
  const along = side === 'left' || side === 'right' ? 'y' : 'x';
  const inPx = side === 'left' || side === 'bottom';
  const factor = inPx ? 1 : (marks.pixel_mm ?? 1);
  const zero = inPx ? 0 : (marks.origin_px?.[along === 'x' ? 0 : 1] ?? 0);
  const first = toImage(view, canvas, 0, 0)[along];
  const last = toImage(view, canvas, canvas.width, canvas.height)[along];
  const length = along === 'x' ? image.width : image.height;
  const spacing = ((along === 'x' ? 64 : 44) / view.zoom) * factor;
  const low = (Math.max(first, 0) - zero) * factor;
  const high = (Math.min(last, length) - zero) * factor;
  const step = roundAbove(spacing);
  context.fillStyle = palette.muted;
  context.strokeStyle = palette.edge;
  context.lineWidth = 1;
  context.font = '12px system-ui, sans-serif';
  context.textAlign = along === 'x' ? 'center' : side === 'left' ? 'right' : 'left';
  context.textBaseline = along === 'y' ? 'middle' : side === 'top' ? 'bottom' : 'top';
  context.beginPath();
  for (const value of ticks(low, high, spacing)) {
    // A pixel's number, and its place in mm, are those of its centre.
    const image_ = value / factor + zero + 0.5;
    const at = toScreen(view, canvas, image_, image_)[along];
    const text = tickText(value, step);
    if (at > (along === 'x' ? canvas.width : canvas.height)) continue;
    if (along === 'x') {
      const y = side === 'top' ? gutter.top : gutter.top + canvas.height;
      const out = side === 'top' ? -4 : 4;
      context.moveTo(gutter.left + at, y);
      context.lineTo(gutter.left + at, y + out);
      // The last label may reach beyond the picture, but not beyond the canvas.
      const half = context.measureText(text).width / 2 + 1;
      const right = gutter.left + canvas.width + gutter.right;
      context.fillText(text, Math.min(gutter.left + at, right - half), y + out * 1.5);
    } else {
      const x = side === 'left' ? gutter.left : gutter.left + canvas.width;
      const out = side === 'left' ? -4 : 4;
      context.moveTo(x, gutter.top + at);
      context.lineTo(x + out, gutter.top + at);
      context.fillText(text, x + out * 1.7, gutter.top + at);
    }
  }
  context.stroke();
}

function axes(context: Context, marks: Marks): void {
  const { canvas, gutter, palette } = marks;
  axis(context, marks, 'left');
  axis(context, marks, 'bottom');
  context.fillStyle = palette.muted;
  context.font = '600 12px system-ui, sans-serif';
  context.textAlign = 'left';
  context.textBaseline = 'top';
  context.fillText('px', 4, gutter.top + canvas.height + 6);
  if (marks.pixel_mm === null || marks.origin_px === null || gutter.right === 0) return;
  axis(context, marks, 'top');
  axis(context, marks, 'right');
  context.fillStyle = palette.muted;
  context.font = '600 12px system-ui, sans-serif';
  context.textAlign = 'right';
  context.textBaseline = 'bottom';
  context.fillText('mm', gutter.left + canvas.width + gutter.right - 4, gutter.top - 6);
}

export function drawMarks(context: Context, marks: Marks, devicePixels: number): void {
  const { canvas, gutter } = marks;
  context.setTransform(devicePixels, 0, 0, devicePixels, 0, 0);
  context.clearRect(0, 0, 1e5, 1e5);
  axes(context, marks);
  context.save();
  context.beginPath();
  context.rect(gutter.left, gutter.top, canvas.width, canvas.height);
  context.clip();
  context.translate(gutter.left, gutter.top);
  drawLevel(context, marks);
  if (marks.region) drawRegion(context, marks, marks.region, [6, 4]);
  marks.lines.forEach((line, index) => drawLine(context, marks, line, lettersOf(index)));
  if (marks.hover) cross(context, marks, marks.hover, 5, [2, 2]);
  if (marks.pin) cross(context, marks, marks.pin, 14, []);
  scaleBar(context, marks);
  context.restore();
}
