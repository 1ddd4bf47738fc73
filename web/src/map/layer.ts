// One layer of the map on the GPU: a texture of the tiles in sight, and one of coarse tiles.

import { coarseWindow, levelFor, sameWindow, TILE, windowFor, type Window } from './pyramid';
import { NOT_LOADED, type TileSource } from './source';
import type { TileName, Tiles } from './tiles';
import type { Size, View } from './view';

class TileTexture {
  readonly texture: WebGLTexture;
  private window: Window | null = null;
  private key = '';
  private scale = 1;
  private filled = new Set<number>();

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    }
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
      gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    }
    this.clear(1, 1);
  }

  private clear(width: number, height: number): void {
    const { gl } = this;
    const empty = new Float32Array(width * height).fill(NOT_LOADED);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32F, width, height, 0, gl.RED, gl.FLOAT, empty);
  }

  /** Takes in what tiles have come; returns those that are still wanted. */
  update(source: TileSource, window: Window, tiles: Tiles): TileName[] {
    const { gl } = this;
    if (source.key !== this.key || !this.window || !sameWindow(window, this.window)) {
      this.key = source.key;
      this.window = window;
      this.scale = source.step * 2 ** window.level;
      this.filled = new Set();
      this.clear(window.columns * TILE, window.rows * TILE);
    }
    const wanted: TileName[] = [];
    tilesOf(source, window).forEach((name, index) => {
      const tile = tiles.get(name);
      if (!tile) wanted.push(name);
      if (!tile || this.filled.has(index)) return;
      const [x, y] = [(name.column - window.column) * TILE, (name.row - window.row) * TILE];
      gl.bindTexture(gl.TEXTURE_2D, this.texture);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, TILE, TILE, gl.RED, gl.FLOAT, tile);
      this.filled.add(index);
    });
    return wanted;
  }

  /** First column and row, and image px per value. */
  place(): [number, number, number] {
    const window = this.window;
    return window ? [window.column * TILE, window.row * TILE, this.scale] : [0, 0, 1];
  }
}

/** What of the image is in sight. */
export interface Sight {
  view: View;
  canvas: Size;
  image: Size;
  devicePixels: number;
}

/** Size of the image in values of the source. */
function sizeOf(source: TileSource, image: Size): Size {
  return { width: image.width / source.step, height: image.height / source.step };
}

/** The tiles of a window. */
export function tilesOf(source: TileSource, window: Window): TileName[] {
  return Array.from({ length: window.rows * window.columns }, (_, index) => ({
    source,
    level: window.level,
    row: window.row + Math.floor(index / window.columns),
    column: window.column + (index % window.columns),
  }));
}

export class Layer {
  private shown: TileSource | null = null;
  private readonly fine: TileTexture;
  private readonly coarse: TileTexture;

  constructor(
    private readonly gl: WebGL2RenderingContext,
    private readonly name: string,
    private readonly unit: number,
  ) {
    this.fine = new TileTexture(gl);
    this.coarse = new TileTexture(gl);
  }

  /** Brings the textures up to date; returns the tiles that are wanted, coarse ones first. */
  update(source: TileSource, sight: Sight, tiles: Tiles): TileName[] {
    const coarse = coarseWindow(sizeOf(source, sight.image), source.levels);
    const missing = tilesOf(source, coarse).filter((name) => !tiles.get(name));
    if (missing.length > 0 && this.shown && source.group && this.shown.group === source.group) {
      // The frame before stays on the screen until this one has come: no flicker.
      return [...missing, ...this.updateTo(this.shown, coarse, sight, tiles)];
    }
    this.shown = source;
    return this.updateTo(source, coarse, sight, tiles);
  }

  private updateTo(source: TileSource, coarse: Window, sight: Sight, tiles: Tiles): TileName[] {
    const { view, canvas, devicePixels } = sight;
    const own = sizeOf(source, sight.image);
    const scaled = { x: view.x / source.step, y: view.y / source.step, zoom: view.zoom * source.step };
    const level = levelFor(scaled.zoom, devicePixels, source.levels);
    const fine = windowFor(scaled, canvas, own, level);
    return [...this.coarse.update(source, coarse, tiles), ...this.fine.update(source, fine, tiles)];
  }

  /** Hands textures and places to the program. */
  bind(locate: (name: string) => WebGLUniformLocation | null): void {
    const { gl } = this;
    const pairs = [
      [this.fine, `u_${this.name}`, this.unit],
      [this.coarse, `u_${this.name}_coarse`, this.unit + 1],
    ] as const;
    for (const [tile, name, unit] of pairs) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, tile.texture);
      gl.uniform1i(locate(name), unit);
      gl.uniform3f(locate(`${name}_place`), ...tile.place());
    }
    gl.activeTexture(gl.TEXTURE0 + 15);
  }

  /** Image px per value of the fine texture. */
  side(): number {
    return this.fine.place()[2];
  }
}
