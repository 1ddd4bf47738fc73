// Draws a picture with its overlays: greys below, patterns of the screen where masks say so, marks on top.

import { edged } from '../components/picture';
import { toScreen, type Size, type View } from '../map/view';
import type { PictureHead } from './api';
import type { Layers } from './picture_layers';

export interface Scene {
  view: View;
  /** Of the pane, in px of the page. */
  size: Size;
  devicePixels: number;
  head: PictureHead;
  layers: Layers;
  grid: boolean;
  corners: readonly [number, number][];
  peakColour: string;
}

/** A pattern that repeats on the screen; drawn by `paint` on a square of `edge` px. */
function tile(
  edge: number,
  paint: (context: CanvasRenderingContext2D, edge: number) => void,
): HTMLCanvasElement {
  const canvas = document.createElement('canvas');
  canvas.width = edge;
  canvas.height = edge;
  paint(canvas.getContext('2d')!, edge);
  return canvas;
}

function stripes(context: CanvasRenderingContext2D, edge: number): void {
  for (let y = 0; y < edge; y += 1) {
    for (let x = 0; x < edge; x += 1) {
      context.fillStyle = (x + y) % edge < edge / 2 ? '#000' : '#fff';
      context.fillRect(x, y, 1, 1);
    }
  }
}

function dots(context: CanvasRenderingContext2D, edge: number): void {
  context.fillStyle = '#000';
  context.fillRect(0, 0, edge, edge);
  context.fillStyle = '#fff';
  context.fillRect(edge / 2 - 1, edge / 2 - 1, 2, 2);
}

export class PicturePainter {
  private readonly scratch = document.createElement('canvas');
  private readonly stripes = tile(8, stripes);
  private readonly dots = tile(8, dots);

  constructor(private readonly canvas: HTMLCanvasElement) {}

  draw(scene: Scene): void {
    const context = this.canvas.getContext('2d')!;
    const { size, devicePixels, head, layers } = scene;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.image(context, scene, layers.grey, scene.view.zoom * head.bin * devicePixels < 1);
    const fillOf = (pattern: HTMLCanvasElement): CanvasPattern => context.createPattern(pattern, 'repeat')!;
    if (layers.sharp) this.masked(context, scene, layers.sharp, scene.peakColour);
    if (layers.saturated) this.masked(context, scene, layers.saturated, fillOf(this.stripes));
    if (layers.dark) this.masked(context, scene, layers.dark, fillOf(this.dots));
    context.setTransform(devicePixels, 0, 0, devicePixels, 0, 0);
    if (scene.grid) drawGrid(context, scene.view, size, head);
    drawCorners(context, scene.view, size, scene.corners);
  }

  /** Draws an image of values where they lie in the frame. */
  private image(
    context: CanvasRenderingContext2D,
    { view, size, devicePixels, head }: Scene,
    image: HTMLCanvasElement,
    smooth: boolean,
  ): void {
    const from = toScreen(view, size, head.x, head.y);
    const scale = view.zoom * head.bin * devicePixels;
    context.imageSmoothingEnabled = smooth;
    context.drawImage(
      image,
      from.x * devicePixels,
      from.y * devicePixels,
      head.columns * scale,
      head.rows * scale,
    );
  }

  /** Fills with a pattern where the mask is opaque. */
  private masked(
    context: CanvasRenderingContext2D,
    scene: Scene,
    mask: HTMLCanvasElement,
    fill: string | CanvasPattern,
  ): void {
    const { scratch } = this;
    scratch.width = this.canvas.width;
    scratch.height = this.canvas.height;
    const below = scratch.getContext('2d')!;
    this.image(below, scene, mask, false);
    below.globalCompositeOperation = 'source-in';
    below.fillStyle = fill;
    below.fillRect(0, 0, scratch.width, scratch.height);
    context.drawImage(scratch, 0, 0);
  }
}

const PARTS = 6;

function drawGrid(context: CanvasRenderingContext2D, view: View, size: Size, head: PictureHead): void {
  const from = toScreen(view, size, 0, 0);
  const to = toScreen(view, size, head.frame_columns, head.frame_rows);
  context.beginPath();
  for (let part = 1; part < PARTS; part += 1) {
    const x = from.x + ((to.x - from.x) * part) / PARTS;
    const y = from.y + ((to.y - from.y) * part) / PARTS;
    context.moveTo(x, from.y);
    context.lineTo(x, to.y);
    context.moveTo(from.x, y);
    context.lineTo(to.x, y);
  }
  edged(context, [], 1, 'rgb(255 255 255 / 0.8)');
}

const ARM = 5;

function drawCorners(
  context: CanvasRenderingContext2D,
  view: View,
  size: Size,
  corners: readonly [number, number][],
): void {
  if (corners.length === 0) return;
  context.beginPath();
  for (const [column, row] of corners) {
    // A corner at (3, 5) lies in the middle of that pixel.
    const { x, y } = toScreen(view, size, column + 0.5, row + 0.5);
    context.moveTo(x - ARM, y);
    context.lineTo(x + ARM, y);
    context.moveTo(x, y - ARM);
    context.lineTo(x, y + ARM);
  }
  edged(context, [], 1.5, '#fff');
}
