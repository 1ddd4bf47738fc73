// Draws the live map and its pin, and takes what mouse, fingers and keys do on it.

import { effect, signal } from '@preact/signals';
import { handleOf, type MapHandle } from '../map/handle';
import { drawLoupe } from '../map/loupe';
import { drawMarks, type Gutter, type Marks } from '../map/marks';
import { listenToPointers } from '../map/pointer';
import { Renderer, type Scene } from '../map/renderer';
import { arraySource, type TileSource } from '../map/source';
import { Tiles } from '../map/tiles';
import { bounded, fitted, pixelAt, showing, zoomedAt, type Pixel, type Size, type View } from '../map/view';
import { clipMarks, palette } from '../store/settings';
import { liveHover, liveKind, liveMap, livePair, livePin, liveRange, type Cell } from './live_map';

const GUTTER: Gutter = { left: 40, top: 8, right: 4, bottom: 24 };
const FRACTION = 1.5;

const ARROWS: Record<string, [dx: number, dy: number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

export class LiveCanvas implements MapHandle {
  private renderer: Renderer | null = null;
  private readonly tiles = new Tiles(() => this.redraw());
  private readonly context: CanvasRenderingContext2D;
  /** null: the whole map. */
  private readonly looked = signal<View | null>(null);
  private size: Size = { width: 1, height: 1 };
  private source: TileSource | null = null;
  private waiting = false;
  private loupe: Pixel | null = null;
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
        void [
          clipMarks.value,
          livePair.value,
          liveKind.value,
          liveRange.value,
          livePin.value,
          liveHover.value,
        ];
        void [palette.value, this.looked.value];
        this.redraw();
      }),
    );
    handleOf.value = this;
  }

  end(): void {
    if (handleOf.peek() === this) handleOf.value = null;
    for (const ending of this.endings) ending();
    this.renderer = null;
    // Browsers allow few contexts, and free them late.
    this.gl.getContext('webgl2')?.getExtension('WEBGL_lose_context')?.loseContext();
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
    this.size = {
      width: Math.max(Math.round(box.width - GUTTER.left - GUTTER.right), 1),
      height: Math.max(Math.round(box.height - GUTTER.top - GUTTER.bottom), 1),
    };
    Object.assign(this.gl.style, {
      left: `${GUTTER.left}px`,
      top: `${GUTTER.top}px`,
      width: `${this.size.width}px`,
      height: `${this.size.height}px`,
    });
    this.redraw();
  }

  /** Rows, columns and px of the frame per value; a single value while there is no map. */
  private shape(): { rows: number; columns: number; bin: number } {
    return liveMap.peek()?.head ?? { rows: 1, columns: 1, bin: 1 };
  }

  private image(): Size {
    const { rows, columns, bin } = this.shape();
    return { width: columns * bin, height: rows * bin };
  }

  view(): View {
    return this.looked.peek() ?? fitted(this.image(), this.size);
  }

  private look(view: View): void {
    this.looked.value = bounded(view, this.image(), this.size);
  }

  zoomBy(factor: number): void {
    const pin = livePin.peek();
    const { width, height } = this.size;
    const view = pin ? showing(this.view(), this.size, this.pixelOf(pin)) : this.view();
    const at = pin ? this.pixelOf(pin) : { x: view.x, y: view.y };
    const x = (at.x - view.x) * view.zoom + width / 2;
    const y = (at.y - view.y) * view.zoom + height / 2;
    this.look(zoomedAt(view, this.size, factor, x, y));
  }

  fit(): void {
    this.looked.value = null;
  }

  /** Moves the pin by values of the map; without a pin it is set in the middle of the view. */
  movePin(dx: number, dy: number): void {
    const { rows, columns, bin } = this.shape();
    if (!liveMap.peek()) return;
    const { x, y } = this.view();
    const from = livePin.peek() ?? { column: Math.floor(x / bin) - dx, row: Math.floor(y / bin) - dy };
    const moved = {
      column: Math.min(Math.max(from.column + dx, 0), columns - 1),
      row: Math.min(Math.max(from.row + dy, 0), rows - 1),
    };
    livePin.value = moved;
    if (this.looked.peek()) this.look(showing(this.view(), this.size, this.pixelOf(moved)));
  }

  /** The middle of a cell, in px of the frame. */
  private pixelOf({ row, column }: Cell): Pixel {
    const { bin } = this.shape();
    return { x: (column + 0.5) * bin - 0.5, y: (row + 0.5) * bin - 0.5 };
  }

  private cellAt(x: number, y: number): Cell | null {
    const { bin } = this.shape();
    const pixel = pixelAt(this.view(), this.size, this.image(), x, y);
    return pixel && { column: Math.floor(pixel.x / bin), row: Math.floor(pixel.y / bin) };
  }

  private listen(): void {
    listenToPointers(this.marks, () => ({ x: GUTTER.left, y: GUTTER.top }), {
      pin: (x, y) => {
        const cell = liveMap.peek() && this.cellAt(x, y);
        if (cell) livePin.value = cell;
      },
      hover: (place) => (liveHover.value = place && liveMap.peek() && this.cellAt(place.x, place.y)),
      pan: (dx, dy) => {
        const view = this.view();
        this.look({ ...view, x: view.x - dx / view.zoom, y: view.y - dy / view.zoom });
      },
      zoom: (factor, x, y) => this.look(zoomedAt(this.view(), this.size, factor, x, y)),
      // Lines and regions are for results.
      draw: () => undefined,
      drawn: () => undefined,
      loupe: (place) => {
        this.loupe = place;
        this.redraw();
      },
      tool: () => 'pin',
    });
    this.marks.addEventListener('keydown', (event) => this.onKey(event));
  }

  private onKey(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = ARROWS[event.key];
    const far = event.shiftKey ? 10 : 1;
    if (arrow) this.movePin(arrow[0] * far, arrow[1] * far);
    else if (event.key === '+' || event.key === '=') this.zoomBy(FRACTION);
    else if (event.key === '-') this.zoomBy(1 / FRACTION);
    else if (event.key === '0') this.fit();
    else return;
    event.preventDefault();
    // The page has the same keys; they would act twice.
    event.stopPropagation();
  }

  redraw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  private sourceNow(): TileSource | null {
    const [map, pair] = [liveMap.peek(), livePair.peek()];
    if (!map || !pair) return null;
    const group = `live/${liveKind.peek()}`;
    const key = `${group}/${pair.scan}/${pair.number}`;
    // The map before stays on the screen until this one has come: no flicker.
    if (this.source?.key !== key) {
      this.source = { ...arraySource(key, map.values, map.head.columns, map.head.bin), group };
    }
    return this.source;
  }

  private scene(): Scene | null {
    const source = this.sourceNow();
    const range = liveRange.peek();
    if (!source || !range) return null;
    return {
      view: this.view(),
      canvas: this.size,
      image: this.image(),
      devicePixels: Math.min(devicePixelRatio, 2),
      source,
      range,
      log: liveKind.peek() === 'sigma',
      marksClipped: clipMarks.peek() === 'on',
      colours: liveKind.peek() === 'sigma' ? 'magma' : 'viridis',
      codes: null,
      hillshade: false,
      fast: false,
      photo: null,
      mask: null,
    };
  }

  private draw(): void {
    const scene = this.scene();
    if (!scene || !this.renderer) return;
    this.tiles.want(this.renderer.draw(scene, this.tiles));
    const { devicePixels } = scene;
    const box = this.marks.getBoundingClientRect();
    const [width, height] = [Math.round(box.width * devicePixels), Math.round(box.height * devicePixels)];
    if (this.marks.width !== width) this.marks.width = width;
    if (this.marks.height !== height) this.marks.height = height;
    const [pin, hover] = [livePin.peek(), liveHover.peek()];
    const marks: Marks = {
      view: scene.view,
      canvas: this.size,
      gutter: GUTTER,
      image: scene.image,
      pixel_mm: null,
      origin_px: null,
      palette: palette.peek(),
      pin: pin && this.pixelOf(pin),
      hover: hover && this.pixelOf(hover),
      lines: [],
      region: null,
      level: { region: null, points: [] },
    };
    drawMarks(this.context, marks, devicePixels);
    if (this.loupe) drawLoupe(this.context, this.gl, this.loupe, marks, devicePixels);
  }
}
