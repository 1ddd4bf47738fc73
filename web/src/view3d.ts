// The 3-D view: the surface as a mesh, turned with mouse or fingers. Loaded only when it is asked for.

import {
  AmbientLight,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  Group,
  Line,
  LineBasicMaterial,
  Mesh,
  MeshLambertMaterial,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import type { MeshInfo } from './api';
import type { LengthUnit } from './format/lengths';
import { axesOf, endAxes, sizeWords } from './view3d_axes';

export interface View3dState {
  exaggeration: number;
  colour: 'height' | 'photograph';
  table: Uint8Array;
  low_mm: number;
  high_mm: number;
  unit: LengthUnit;
  /** The pixel at 0 mm. */
  origin_px: [x: number, y: number];
  pin: { x: number; y: number } | null;
  ground: string;
  ink: string;
}

/** Triangles of all squares whose four corners have heights. */
function trianglesOf(heights: Float32Array, rows: number, columns: number): Uint32Array {
  const triangles: number[] = [];
  for (let row = 0; row + 1 < rows; row += 1) {
    for (let column = 0; column + 1 < columns; column += 1) {
      const corner = row * columns + column;
      const corners = [corner, corner + 1, corner + columns, corner + columns + 1] as const;
      if (corners.some((index) => !Number.isFinite(heights[index]))) continue;
      triangles.push(corners[0], corners[2], corners[1], corners[1], corners[2], corners[3]);
    }
  }
  return new Uint32Array(triangles);
}

export class View3d {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(35, 1.5, 0.01, 1e5);
  private readonly controls: OrbitControls;
  private readonly mesh: Mesh<BufferGeometry, MeshLambertMaterial>;
  private readonly post: Line<BufferGeometry, LineBasicMaterial>;
  private readonly heights: Float32Array;
  private readonly photograph: Float32Array;
  private readonly side: number;
  /** Of a sphere around the surface, in mm. */
  private radius = 1;
  private axes = new Group();
  /** First and last column, first and last row that have heights. */
  private known: [left: number, right: number, top: number, bottom: number] = [0, 1, 0, 1];
  private waiting = false;

  constructor(
    canvas: HTMLCanvasElement,
    private readonly head: MeshInfo,
    values: Float32Array,
  ) {
    const size = head.rows * head.columns;
    this.heights = values.subarray(0, size);
    this.photograph = values.subarray(size, 2 * size);
    this.side = head.step * head.pixel_mm;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: 'low-power' });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(size * 3), 3));
    geometry.setAttribute('color', new BufferAttribute(new Float32Array(size * 3), 3));
    geometry.setIndex(new BufferAttribute(trianglesOf(this.heights, head.rows, head.columns), 1));
    this.mesh = new Mesh(geometry, new MeshLambertMaterial({ vertexColors: true, side: 2 }));
    this.post = new Line(new BufferGeometry(), new LineBasicMaterial());
    const light = new DirectionalLight(0xffffff, 2);
    light.position.set(-1, 1, 1.6);
    this.scene.add(this.mesh, this.post, light, new AmbientLight(0xffffff, 1.2));
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.redraw());
    this.lookAtSurface();
    this.camera.up.set(0, 0, 1);
    this.controls.update();
  }

  /** Stands the camera before the part that has heights. */
  private lookAtSurface(): void {
    const { rows, columns } = this.head;
    let [left, right, top, bottom] = [columns, 0, rows, 0];
    this.heights.forEach((height, index) => {
      if (!Number.isFinite(height)) return;
      const [column, row] = [index % columns, Math.floor(index / columns)];
      [left, right] = [Math.min(left, column), Math.max(right, column)];
      [top, bottom] = [Math.min(top, row), Math.max(bottom, row)];
    });
    if (right <= left || bottom <= top) [left, right, top, bottom] = [0, columns, 0, rows];
    this.known = [left, right, top, bottom];
    const middle = new Vector3((left + right - columns) / 2, (rows - top - bottom) / 2, 0);
    this.radius = (Math.hypot(right - left, bottom - top) / 2) * this.side;
    this.controls.target.copy(middle.multiplyScalar(this.side));
    const away = new Vector3(0, -1, 1).setLength(this.distance());
    this.camera.position.copy(this.controls.target).add(away);
  }

  /** From how far away the surface fills the picture, with room for the words of the axes. */
  private distance(): number {
    const half = (this.camera.fov / 360) * Math.PI;
    const across = Math.atan(Math.tan(half) * this.camera.aspect);
    // Seen from above it is less high than a sphere around it.
    return this.radius * Math.max(0.85 / Math.sin(half), 1.5 / Math.sin(across));
  }

  /** Brings mesh, colours and post up to date. */
  show(state: View3dState): void {
    const { rows, columns } = this.head;
    const { geometry } = this.mesh;
    const position = geometry.getAttribute('position') as BufferAttribute;
    const colours = geometry.getAttribute('color') as BufferAttribute;
    const middle = (state.low_mm + state.high_mm) / 2;
    const colour = new Color();
    for (let index = 0; index < rows * columns; index += 1) {
      const height = this.heights[index] ?? NaN;
      const x = ((index % columns) - (columns - 1) / 2) * this.side;
      const y = ((rows - 1) / 2 - Math.floor(index / columns)) * this.side;
      position.setXYZ(index, x, y, Number.isFinite(height) ? (height - middle) * state.exaggeration : 0);
      if (state.colour === 'photograph') {
        const grey = this.photograph[index] ?? 0;
        colour.setRGB(grey, grey, grey, 'srgb');
      } else {
        const at = (height - state.low_mm) / Math.max(state.high_mm - state.low_mm, 1e-9);
        const entry = Math.round(Math.min(Math.max(at || 0, 0), 1) * 255) * 4;
        const part = (channel: number): number => (state.table[entry + channel] ?? 0) / 255;
        colour.setRGB(part(0), part(1), part(2), 'srgb');
      }
      colours.setXYZ(index, colour.r, colour.g, colour.b);
    }
    position.needsUpdate = true;
    colours.needsUpdate = true;
    geometry.computeVertexNormals();
    geometry.computeBoundingSphere();
    this.scene.background = new Color(state.ground);
    this.placePost(state, middle);
    this.placeAxes(state, middle);
    this.redraw();
  }

  /** Axes along the near edges of the part that has heights, at its lowest height. */
  private placeAxes(state: View3dState, middle: number): void {
    const { rows, columns, step, pixel_mm } = this.head;
    const [left, right, top, bottom] = this.known;
    const x = (column: number): number => (column - (columns - 1) / 2) * this.side;
    const y = (row: number): number => ((rows - 1) / 2 - row) * this.side;
    const z = (height_mm: number): number => (height_mm - middle) * state.exaggeration;
    // The middle of a block of pixels is what its height belongs to.
    const mm = (block: number, zero_px: number): number =>
      ((block + 0.5) * step - 0.5 - zero_px) * pixel_mm;
    const [zero_x, zero_y] = state.origin_px;
    const { low_mm, high_mm, unit } = state;
    const at = (column: number, row: number, height_mm: number): Vector3 =>
      new Vector3(x(column), y(row), z(height_mm));
    endAxes(this.axes);
    this.scene.remove(this.axes);
    this.axes = axesOf(
      [
        {
          from: at(left, bottom, low_mm),
          to: at(right, bottom, low_mm),
          first: mm(left, zero_x),
          last: mm(right, zero_x),
          out: new Vector3(0, -1, 0),
          label: 'x (mm)',
          anchor: [0.5, 1],
        },
        {
          from: at(left, bottom, low_mm),
          to: at(left, top, low_mm),
          first: mm(bottom, zero_y),
          last: mm(top, zero_y),
          out: new Vector3(-1, 0, 0),
          label: 'y (mm)',
          anchor: [1, 0.5],
        },
        {
          from: at(right, bottom, low_mm),
          to: at(right, bottom, high_mm),
          first: low_mm * unit.factor,
          last: high_mm * unit.factor,
          out: new Vector3(1, 0, 0),
          label: `height (${unit.label})`,
          anchor: [0, 0.5],
        },
      ],
      2 * this.radius,
      state.ink,
    );
    this.sizeWords();
    this.scene.add(this.axes);
  }

  private sizeWords(): void {
    const height = this.renderer.domElement.height / this.devicePixels;
    sizeWords(this.axes, (2 * Math.tan((this.camera.fov / 360) * Math.PI)) / Math.max(height, 1));
  }

  /** A thin post stands on the pin. */
  private placePost(state: View3dState, middle: number): void {
    this.post.visible = state.pin !== null;
    if (!state.pin) return;
    const { rows, columns, step } = this.head;
    const column = Math.min(Math.round(state.pin.x / step), columns - 1);
    const row = Math.min(Math.round(state.pin.y / step), rows - 1);
    const x = (column - (columns - 1) / 2) * this.side;
    const y = ((rows - 1) / 2 - row) * this.side;
    const height = this.heights[row * columns + column] ?? NaN;
    const z = Number.isFinite(height) ? (height - middle) * state.exaggeration : 0;
    const length = Math.max(rows, columns) * this.side * 0.08;
    this.post.geometry.setFromPoints([new Vector3(x, y, z), new Vector3(x, y, z + length)]);
    this.post.material.color.set(state.ink);
  }

  /** Width of the object. */
  get width_mm(): number {
    return this.head.columns * this.side;
  }

  resize(width: number, height: number): void {
    this.renderer.setSize(width, height, false);
    const before = this.distance();
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
    // A narrower picture is looked at from further away, so that all of the surface stays in it.
    this.moveNearer(this.distance() / before);
    this.sizeWords();
    this.controls.update();
    this.redraw();
  }

  /** Turns the view with the keyboard. */
  turn(degrees: number, zoom: number): void {
    const angle = (degrees / 180) * Math.PI;
    const { target } = this.controls;
    this.camera.position
      .sub(target)
      .applyAxisAngle(new Vector3(0, 0, 1), angle)
      .add(target);
    this.moveNearer(zoom);
    this.controls.update();
    this.redraw();
  }

  /** Changes the distance to what is looked at by a factor. */
  private moveNearer(factor: number): void {
    const { target } = this.controls;
    this.camera.position.sub(target).multiplyScalar(factor).add(target);
  }

  private redraw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.renderer.render(this.scene, this.camera);
    });
  }

  get devicePixels(): number {
    return this.renderer.getPixelRatio();
  }

  /** What is on the screen. */
  picture(): HTMLCanvasElement {
    // WebGL keeps what it has drawn only until the browser shows it.
    this.renderer.render(this.scene, this.camera);
    const { domElement } = this.renderer;
    const copy = document.createElement('canvas');
    [copy.width, copy.height] = [domElement.width, domElement.height];
    copy.getContext('2d')!.drawImage(domElement, 0, 0);
    return copy;
  }

  end(): void {
    endAxes(this.axes);
    this.controls.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
    this.renderer.dispose();
  }
}
