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
    for (let row = 0; row < window.rows; row += 1) {
      for (let column = 0; column < window.columns; column += 1) {
        const name = {
          source,
          level: window.level,
          row: window.row + row,
          column: window.column + column,
        };
        const index = row * window.columns + column;
        const tile = tiles.get(name);
        if (!tile) wanted.push(name);
        if (!tile || this.filled.has(index)) continue;
        gl.bindTexture(gl.TEXTURE_2D, this.texture);
        const [x, y] = [column * TILE, row * TILE];
        gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, TILE, TILE, gl.RED, gl.FLOAT, tile);
        this.filled.add(index);
      }
    }
    return wanted;
  }

  /** First column and row, and image px per value. */
  place(): [number, number, number] {
    const window = this.window;
    return window ? [window.column * TILE, window.row * TILE, this.scale] : [0, 0, 1];
  }
}

export class Layer {
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
  update(
    source: TileSource,
    view: View,
    canvas: Size,
    image: Size,
    devicePixels: number,
    tiles: Tiles,
  ): TileName[] {
    const own = { width: image.width / source.step, height: image.height / source.step };
    const scaled = { x: view.x / source.step, y: view.y / source.step, zoom: view.zoom * source.step };
    const level = levelFor(scaled.zoom, devicePixels, source.levels);
    const fine = windowFor(scaled, canvas, own, level);
    const coarse = coarseWindow(own, source.levels);
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
