// Ties the map's canvases to the selection: one frame loop, drawn only when something has changed.

import { effect } from '@preact/signals';
import { choose, levelMarks } from '../store/levelled';
import { drawing, drawLine, hover, lines, select, selection, tool } from '../store/selection';
import { origin_px } from '../store/questions';
import { results } from '../store/results';
import { clipMarks, hillshade, maskHatch, palette, photo } from '../store/settings';
import { significant } from '../format/number';
import { field, frameField, shownColours, shownRange } from './field';
import { drawLoupe } from './loupe';
import { drawMarks, type Gutter, type Marks } from './marks';
import { listenToPointers } from './pointer';
import { Renderer, type Scene } from './renderer';
import { mapSource } from './source';
import { coarseWindow } from './pyramid';
import { tilesOf } from './layer';
import { Tiles, type TileName } from './tiles';
import { handleOf, handleMoves, pictureOf, type MapHandle, type Picture } from './handle';
import { bounded, fitted, fittedTo, pixelAt, showing, zoomedAt, type Size, type View } from './view';

const WIDE: Gutter = { left: 46, top: 22, right: 46, bottom: 24 };
const NARROW: Gutter = { left: 40, top: 4, right: 0, bottom: 24 };

export class MapController implements MapHandle {
  private renderer: Renderer | null = null;
  private readonly tiles = new Tiles(() => this.redraw());
  private readonly context: CanvasRenderingContext2D;
  private size: Size = { width: 1, height: 1 };
  private gutter = WIDE;
  private waiting = false;
  private loupe: { x: number; y: number } | null = null;
  private readonly endings: (() => void)[] = [];

  constructor(
    private readonly gl: HTMLCanvasElement,
    private readonly marks: HTMLCanvasElement,
    private readonly failed: (message: string) => void,
  ) {
    const context = marks.getContext('2d');
    if (!context) throw new Error('This browser has no 2-D canvas.');
    this.context = context;
    this.begin();
    gl.addEventListener('webglcontextlost', (event) => event.preventDefault());
    gl.addEventListener('webglcontextrestored', () => this.begin());
    const observer = new ResizeObserver(() => this.measure());
    observer.observe(marks);
    this.endings.push(() => observer.disconnect());
    this.listen();
    this.endings.push(
      effect(() => {
        // Whatever the picture depends on.
        void [selection.value, hover.value, field.value, shownRange.value, palette.value, results.value];
        void [
          hillshade.value,
          maskHatch.value,
          photo.value,
          clipMarks.value,
          handleMoves.value,
          origin_px.value,
          levelMarks.value,
        ];
        this.redraw();
      }),
    );
    handleOf.value = this;
    pictureOf.value = () => this.picture();
  }

  end(): void {
    handleOf.value = pictureOf.value = null;
    for (const ending of this.endings) ending();
  }

  private begin(): void {
    try {
      this.renderer = new Renderer(this.gl);
      this.redraw();
    } catch (error) {
      this.failed(error instanceof Error ? error.message : String(error));
    }
  }

  private measure(): void {
    const box = this.marks.getBoundingClientRect();
    this.gutter = box.width < 520 ? NARROW : WIDE;
    const { left, top, right, bottom } = this.gutter;
    this.size = {
      width: Math.max(Math.round(box.width - left - right), 1),
      height: Math.max(Math.round(box.height - top - bottom), 1),
    };
    Object.assign(this.gl.style, {
      left: `${left}px`,
      top: `${top}px`,
      width: `${this.size.width}px`,
      height: `${this.size.height}px`,
    });
    this.redraw();
  }

  private image(): Size {
    const frames = results.value?.frames;
    return { width: frames?.columns ?? 1, height: frames?.rows ?? 1 };
  }

  view(): View {
    const { view } = selection.peek();
    if (view === 'all') return fitted(this.image(), this.size);
    return view ?? fittedTo(results.peek()?.answered_px ?? null, this.image(), this.size);
  }

  private look(view: View): void {
    select({ view: bounded(view, this.image(), this.size) });
  }

  zoomBy(factor: number): void {
    const at = selection.peek().pin;
    const { width, height } = this.size;
    const view = this.view();
    const centred = at ? showing(view, this.size, at) : view;
    const x = at ? (at.x + 0.5 - centred.x) * centred.zoom + width / 2 : width / 2;
    const y = at ? (at.y + 0.5 - centred.y) * centred.zoom + height / 2 : height / 2;
    this.look(zoomedAt(centred, this.size, factor, x, y));
  }

  fit(): void {
    select({ view: 'all' });
  }

  movePin(dx: number, dy: number): void {
    const image = this.image();
    const view = this.view();
    const from = selection.peek().pin ?? { x: Math.floor(view.x) - dx, y: Math.floor(view.y) - dy };
    const moved = {
      x: Math.min(Math.max(from.x + dx, 0), image.width - 1),
      y: Math.min(Math.max(from.y + dy, 0), image.height - 1),
    };
    select({ pin: moved });
    // What shows all of the image shows the pin.
    if (view.zoom <= fitted(image, this.size).zoom) return;
    const followed = showing(view, this.size, moved);
    if (followed.x !== view.x || followed.y !== view.y) this.look(followed);
  }

  private listen(): void {
    const at = (x: number, y: number): { x: number; y: number } | null =>
      pixelAt(this.view(), this.size, this.image(), x, y);
    // Ends of a drawing may lie beside the image; they stop at its edge.
    const within = ({ x, y }: { x: number; y: number }): { x: number; y: number } => {
      const view = this.view();
      const image = this.image();
      const [column, row] = [
        Math.floor((x - this.size.width / 2) / view.zoom + view.x),
        Math.floor((y - this.size.height / 2) / view.zoom + view.y),
      ];
      return {
        x: Math.min(Math.max(column, 0), image.width - 1),
        y: Math.min(Math.max(row, 0), image.height - 1),
      };
    };
    listenToPointers(this.marks, () => ({ x: this.gutter.left, y: this.gutter.top }), {
      pin: (x, y, clicked) => {
        const pixel = at(x, y);
        if (!pixel) return;
        select({ pin: pixel });
        if (clicked && tool.peek() === 'points') choose(pixel);
      },
      hover: (place) => (hover.value = place && at(place.x, place.y)),
      pan: (dx, dy) => {
        const view = this.view();
        this.look({ ...view, x: view.x - dx / view.zoom, y: view.y - dy / view.zoom });
      },
      zoom: (factor, x, y) => this.look(zoomedAt(this.view(), this.size, factor, x, y)),
      draw: (kind, from, to) => {
        const [first, last] = [within(from), within(to)];
        drawing.value = true;
        if (kind === 'line') {
          drawLine({ x0: first.x, y0: first.y, x1: last.x, y1: last.y });
        } else {
          select({
            region: [
              Math.min(first.x, last.x),
              Math.min(first.y, last.y),
              Math.max(first.x, last.x) + 1,
              Math.max(first.y, last.y) + 1,
            ],
          });
        }
      },
      drawn: (kind) => {
        drawing.value = false;
        // What was asked is answered there.
        if (kind === 'region' && selection.peek().region) {
          if (selection.peek().panel !== 'steps') select({ panel: 'region' });
          document.getElementById('panel')?.scrollIntoView({ block: 'nearest' });
        }
        tool.value = 'pin';
      },
      loupe: (place) => {
        this.loupe = place;
        this.redraw();
      },
      tool: () => tool.peek(),
    });
  }

  /** Map and marks as they are on the screen. */
  private picture(): Picture | null {
    // WebGL keeps what it has drawn only until the browser shows it.
    this.draw();
    const [picture, devicePixels] = [document.createElement('canvas'), Math.min(devicePixelRatio, 2)];
    [picture.width, picture.height] = [this.marks.width, this.marks.height];
    const context = picture.getContext('2d');
    if (!context) return null;
    const [left, top, width, height] = [
      this.gutter.left,
      this.gutter.top,
      this.size.width,
      this.size.height,
    ].map((length) => length * devicePixels) as [number, number, number, number];
    context.drawImage(this.gl, left, top, width, height);
    context.drawImage(this.marks, 0, 0);
    const { pixel_mm } = results.value?.geometry ?? {};
    const words = pixel_mm ? [`pixel on the surface ${significant(pixel_mm, 4)} mm`] : [];
    return { picture, devicePixels, words, coloured: true, solid: false };
  }

  redraw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  private scene(): Scene | null {
    const shown = field.value;
    const held = results.value;
    if (!shown || !held) return null;
    const share = shown.id === 'frame' ? 0 : photo.value;
    const behind = share > 0 ? frameField(held.frames.reference, held.frames.matched) : null;
    const mask =
      maskHatch.value && !shown.codes && shown.id !== 'frame'
        ? held.maps.find(({ id }) => id === 'mask')
        : null;
    return {
      view: this.view(),
      canvas: this.size,
      image: this.image(),
      devicePixels: Math.min(devicePixelRatio, 2),
      source: shown.source,
      range: shownRange.value,
      log: shown.scale === 'log',
      marksClipped: clipMarks.value === 'on',
      colours: shownColours.value,
      codes: shown.codes,
      hillshade: hillshade.value && shown.id !== 'frame',
      fast: handleMoves.value,
      photo: behind && { source: behind.source, share, low: behind.low, high: behind.high },
      mask: mask ? mapSource(mask.id, mask.levels) : null,
    };
  }

  private draw(): void {
    const scene = this.scene();
    if (!scene || !this.renderer) return;
    this.tiles.want([...this.renderer.draw(scene, this.tiles), ...this.framesAhead(scene)]);
    const { devicePixels } = scene;
    const box = this.marks.getBoundingClientRect();
    const [width, height] = [Math.round(box.width * devicePixels), Math.round(box.height * devicePixels)];
    if (this.marks.width !== width) this.marks.width = width;
    if (this.marks.height !== height) this.marks.height = height;
    const marks: Marks = {
      view: scene.view,
      canvas: this.size,
      gutter: this.gutter,
      image: scene.image,
      pixel_mm: results.value?.geometry?.pixel_mm ?? null,
      origin_px: origin_px.value,
      palette: palette.value,
      pin: selection.value.pin,
      hover: hover.value,
      lines: lines.value,
      region: selection.value.region,
      level: levelMarks.value,
    };
    drawMarks(this.context, marks, devicePixels);
    if (this.loupe) drawLoupe(this.context, this.gl, this.loupe, marks, devicePixels);
  }

  /** While a frame is shown, coarse tiles of the next ones are loaded, so that they play smoothly. */
  private framesAhead({ image }: Scene): TileName[] {
    const { frame, kind } = selection.value;
    const frames = results.value?.frames;
    if (frame === null || !frames) return [];
    return [1, 2, 3].flatMap((by) => {
      const ahead = frameField((frame + by) % frames.count, kind ?? frames.matched);
      return ahead ? tilesOf(ahead.source, coarseWindow(image, ahead.source.levels)) : [];
    });
  }
}
