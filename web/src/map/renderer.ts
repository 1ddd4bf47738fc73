// Draws the map with WebGL2: one program, three layers (values, photograph, mask).

import { colourTable } from '../colours/tables';
import type { Code } from '../colours/codes';
import type { Colours } from '../api';
import { Layer, type Sight } from './layer';
import { FRAGMENT, VERTEX } from './shaders';
import type { TileSource } from './source';
import { Pace } from './pace';
import type { TileName, Tiles } from './tiles';

export interface Scene extends Sight {
  source: TileSource;
  range: { low: number; high: number };
  log: boolean;
  /** Whether values beyond the range are marked. */
  marksClipped: boolean;
  colours: Colours;
  codes: Code[] | null;
  hillshade: boolean;
  /** While a handle moves, one look-up a pixel is enough. */
  fast: boolean;
  photo: { source: TileSource; share: number; low: number; high: number } | null;
  mask: TileSource | null;
}

function compile(gl: WebGL2RenderingContext, kind: number, text: string): WebGLShader {
  const shader = gl.createShader(kind);
  if (!shader) throw new Error('WebGL2 makes no shader');
  gl.shaderSource(shader, text);
  gl.compileShader(shader);
  return shader;
}

export class Renderer {
  private readonly gl: WebGL2RenderingContext;
  private readonly program: WebGLProgram;
  private readonly locations = new Map<string, WebGLUniformLocation | null>();
  private readonly table: WebGLTexture;
  private colours: Colours | null = null;
  private readonly value: Layer;
  private readonly photo: Layer;
  private readonly mask: Layer;
  private readonly pace = new Pace();

  constructor(private readonly canvas: HTMLCanvasElement) {
    const gl = canvas.getContext('webgl2', {
      antialias: false,
      depth: false,
      powerPreference: 'low-power',
    });
    if (!gl) throw new Error('This browser has no WebGL2, which the map needs. Try another browser.');
    this.gl = gl;
    this.program = gl.createProgram();
    gl.attachShader(this.program, compile(gl, gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(this.program, compile(gl, gl.FRAGMENT_SHADER, FRAGMENT));
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) {
      throw new Error(
        `The map's shader failed: ${gl.getProgramInfoLog(this.program) ?? 'no reason given'}`,
      );
    }
    gl.activeTexture(gl.TEXTURE0 + 15);
    this.table = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.table);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    this.value = new Layer(gl, 'value', 0);
    this.photo = new Layer(gl, 'photo', 2);
    this.mask = new Layer(gl, 'mask', 4);
  }

  private locate = (name: string): WebGLUniformLocation | null => {
    let place = this.locations.get(name);
    if (place === undefined) {
      place = this.gl.getUniformLocation(this.program, name);
      this.locations.set(name, place);
    }
    return place;
  };

  private loadTable(colours: Colours): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + 6);
    gl.bindTexture(gl.TEXTURE_2D, this.table);
    gl.uniform1i(this.locate('u_table'), 6);
    if (colours !== this.colours) {
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, colourTable(colours));
      this.colours = colours;
    }
    // Layers bind their own textures to a spare unit while they load.
    gl.activeTexture(gl.TEXTURE0 + 15);
  }

  /** Draws, and returns the tiles that are still wanted. */
  draw(scene: Scene, tiles: Tiles): TileName[] {
    const { gl, locate } = this;
    const { view, canvas, image } = scene;
    const devicePixels = scene.devicePixels * this.pace.share(scene.fast, performance.now());
    const [width, height] = [canvas.width, canvas.height].map((side) => Math.round(side * devicePixels));
    if (this.canvas.width !== width) this.canvas.width = width!;
    if (this.canvas.height !== height) this.canvas.height = height!;
    const update = (layer: Layer, source: TileSource): TileName[] => layer.update(source, scene, tiles);
    const wanted = update(this.value, scene.source);
    if (scene.photo) wanted.push(...update(this.photo, scene.photo.source));
    if (scene.mask) wanted.push(...update(this.mask, scene.mask));

    gl.viewport(0, 0, width!, height!);
    gl.useProgram(this.program);
    this.loadTable(scene.colours);
    for (const layer of [this.value, this.photo, this.mask]) layer.bind(locate);
    gl.uniform2f(locate('u_canvas'), width!, height!);
    gl.uniform2f(locate('u_centre'), view.x, view.y);
    gl.uniform2f(locate('u_image'), image.width, image.height);
    gl.uniform1f(locate('u_zoom'), view.zoom * devicePixels);
    gl.uniform1f(locate('u_dot'), devicePixels);
    gl.uniform2f(locate('u_range'), scene.range.low, scene.range.high);
    gl.uniform1i(locate('u_log'), scene.log && scene.range.low > 0 ? 1 : 0);
    // Large pixels are shown as squares: they are what was measured.
    const large = view.zoom * devicePixels * this.value.side() >= 3;
    gl.uniform1i(locate('u_smooth'), scene.fast || large ? 0 : 1);
    gl.uniform1i(locate('u_clip'), scene.marksClipped ? 1 : 0);
    gl.uniform1i(locate('u_hillshade'), scene.hillshade ? 1 : 0);
    gl.uniform1i(locate('u_hatch'), scene.mask ? 1 : 0);
    gl.uniform1i(locate('u_coded'), scene.codes ? 1 : 0);
    const codes = new Float32Array(14);
    for (const { code, grey, pattern } of scene.codes ?? []) codes.set([grey, pattern], code * 2);
    gl.uniform2fv(locate('u_codes[0]'), codes);
    gl.uniform1f(locate('u_photo_share'), scene.photo?.share ?? 0);
    gl.uniform2f(locate('u_photo_range'), scene.photo?.low ?? 0, scene.photo?.high ?? 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return wanted;
  }
}
