// Ties the picture's canvas to its feed: one drawing per frame of the screen, only when something changed.

import { computed, effect } from '@preact/signals';
import { handleOf, type MapHandle } from '../map/handle';
import { listenToPointers } from '../map/pointer';
import { bounded, fitted, zoomedAt, type Size, type View } from '../map/view';
import { palette } from '../store/settings';
import type { TargetState } from './api';
import { PicturePainter } from './picture_draw';
import { layersOf, type Layers } from './picture_layers';
import { readPicture, type LivePicture } from './picture_message';
import { age_ms, head, overlays } from './picture_store';
import { oneToOne, wishFor } from './picture_view';
import { openFeed, type Feed } from './socket';
import { rigState } from './store';

const WISH_MS = 50;
const AGE_MS = 200;
const DOUBLE_MS = 350;
const DOUBLE_PX = 24;

const cameraColumns = computed(() => rigState.value?.camera.columns || 1);
const cameraRows = computed(() => rigState.value?.camera.rows || 1);
const cameraSize = computed(() => ({ columns: cameraColumns.value, rows: cameraRows.value }));

export class PictureController implements MapHandle {
  private readonly painter: PicturePainter;
  private feed: Feed | null = null;
  private picture: LivePicture | null = null;
  private layers: Layers | null = null;
  /** null: the whole frame. */
  private looked: View | null = null;
  private size: Size = { width: 1, height: 1 };
  private devicePixels = 1;
  private waiting = false;
  private wishTimer: ReturnType<typeof setTimeout> | undefined;
  private lastTap = { at: 0, x: 0, y: 0 };
  private corners: TargetState['corners'] = [];
  private readonly endings: (() => void)[] = [];

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.painter = new PicturePainter(canvas);
    const observer = new ResizeObserver(() => this.measure());
    observer.observe(canvas);
    const visible = (): void => this.follow(document.visibilityState !== 'hidden');
    document.addEventListener('visibilitychange', visible);
    const ages = setInterval(() => this.tellAge(), AGE_MS);
    this.endings.push(
      () => observer.disconnect(),
      () => document.removeEventListener('visibilitychange', visible),
      () => clearInterval(ages),
      effect(() => {
        void [overlays.zebra.value, overlays.peaking.value, overlays.grid.value, palette.value];
        this.layers = null;
        this.redraw();
      }),
      effect(() => {
        void cameraSize.value;
        this.wish();
      }),
      effect(() => {
        const corners = rigState.value?.target?.corners ?? [];
        if (corners.length === 0 && this.corners.length === 0) return;
        this.corners = corners;
        this.redraw();
      }),
    );
    this.listen();
    visible();
    handleOf.value = this;
  }

  end(): void {
    for (const ending of this.endings) ending();
    this.follow(false);
    clearTimeout(this.wishTimer);
    head.value = null;
    age_ms.value = null;
    if (handleOf.peek() === this) handleOf.value = null;
  }

  /** Pictures come only while somebody can see them. */
  private follow(shown: boolean): void {
    if (shown && !this.feed) {
      this.feed = openFeed('api/rig/picture', (message) => {
        if (message instanceof ArrayBuffer) this.take(message);
      });
      this.sendWish();
    } else if (!shown) {
      this.feed?.close();
      this.feed = null;
    }
  }

  private take(message: ArrayBuffer): void {
    const picture = readPicture(message, performance.now());
    if (!picture) return;
    const before = head.peek();
    const { head: now } = picture;
    this.picture = picture;
    this.layers = null;
    head.value = now;
    if (before?.frame_columns !== now.frame_columns || before.frame_rows !== now.frame_rows) this.wish();
    this.redraw();
    // The number in the bar changes with the clock below, not with each picture.
    if (age_ms.peek() === null) this.tellAge();
  }

  private tellAge(): void {
    if (!this.picture) return;
    age_ms.value = this.picture.head.age_ms + performance.now() - this.picture.arrived;
  }

  /** Size of the frames; 1 x 1 while it is not known. */
  private frame(): Size {
    const { head: shown } = this.picture ?? {};
    const { columns, rows } = cameraSize.peek();
    return { width: shown?.frame_columns ?? columns, height: shown?.frame_rows ?? rows };
  }

  view(): View {
    return this.looked ?? fitted(this.frame(), this.size);
  }

  private look(view: View | null): void {
    this.looked = view && bounded(view, this.frame(), this.size);
    this.wish();
    this.redraw();
  }

  zoomBy(factor: number): void {
    const { width, height } = this.size;
    this.look(zoomedAt(this.view(), this.size, factor, width / 2, height / 2));
  }

  fit(): void {
    this.look(null);
  }

  /** Arrow keys move the view: there is no pin in a live picture. */
  movePin(dx: number, dy: number): void {
    const view = this.view();
    this.look({ ...view, x: view.x + (dx * 20) / view.zoom, y: view.y + (dy * 20) / view.zoom });
  }

  private listen(): void {
    listenToPointers(this.canvas, () => ({ x: 0, y: 0 }), {
      pin: (x, y) => this.tap(x, y),
      hover: () => undefined,
      pan: (dx, dy) => {
        const view = this.view();
        this.look({ ...view, x: view.x - dx / view.zoom, y: view.y - dy / view.zoom });
      },
      zoom: (factor, x, y) => this.look(zoomedAt(this.view(), this.size, factor, x, y)),
      draw: () => undefined,
      drawn: () => undefined,
      loupe: () => undefined,
      tool: () => 'pin',
      finger: 'pan',
    });
  }

  /** Two taps: single pixels, or all again. */
  private tap(x: number, y: number): void {
    const now = performance.now();
    const { lastTap } = this;
    this.lastTap = { at: now, x, y };
    if (now - lastTap.at > DOUBLE_MS || Math.hypot(x - lastTap.x, y - lastTap.y) > DOUBLE_PX) return;
    this.lastTap.at = 0;
    const close = oneToOne(this.view(), this.size, this.devicePixels, x, y);
    this.look(this.looked?.zoom === close.zoom ? null : close);
  }

  private measure(): void {
    const { width, height } = this.canvas.getBoundingClientRect();
    this.size = { width: Math.max(Math.round(width), 1), height: Math.max(Math.round(height), 1) };
    this.devicePixels = Math.min(devicePixelRatio, 2);
    this.canvas.width = Math.round(this.size.width * this.devicePixels);
    this.canvas.height = Math.round(this.size.height * this.devicePixels);
    this.wish();
    this.redraw();
  }

  private wish(): void {
    clearTimeout(this.wishTimer);
    this.wishTimer = setTimeout(() => this.sendWish(), WISH_MS);
  }

  private sendWish(): void {
    if (this.size.width <= 1 || this.frame().width <= 1) return;
    this.feed?.wish(wishFor(this.view(), this.size, this.frame(), this.devicePixels));
  }

  private redraw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      const { picture } = this;
      if (!picture) return;
      this.layers ??= layersOf(picture, {
        zebra: overlays.zebra.peek(),
        peaking: overlays.peaking.peek(),
      });
      this.painter.draw({
        view: this.view(),
        size: this.size,
        devicePixels: this.devicePixels,
        head: picture.head,
        layers: this.layers,
        grid: overlays.grid.peek(),
        corners: this.corners,
        peakColour: palette.peek().warn,
      });
    });
  }
}
