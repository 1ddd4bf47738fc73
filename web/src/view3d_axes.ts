// Axes of the 3-D view: x and y in mm as on the map's edges, and the height.

import {
  BufferGeometry,
  CanvasTexture,
  Group,
  LinearFilter,
  LineBasicMaterial,
  LineSegments,
  SRGBColorSpace,
  Sprite,
  SpriteMaterial,
  Vector3,
} from 'three';
import { significant } from './format/number';
import { roundAbove, ticks, tickText } from './map/scale_bar';

/** Where an axis begins and ends, and the numbers at its ends. */
export interface Axis {
  from: Vector3;
  to: Vector3;
  first: number;
  last: number;
  /** Towards which ticks and words lie. */
  out: Vector3;
  label: string;
  /** On which side of a place its words stand: the point of the words that is there, from 0 to 1. */
  anchor: [x: number, y: number];
}

/** About so many ticks an axis, ... */
const TICKS = 5;
/** ... and ticks no nearer than this, as a share of the size of what is shown. */
const LEAST_APART = 0.06;

/** Pixels of the words' canvas for one px of the page. */
const FINE = 2;

/** Words that face the eye and have one size on the screen, whatever the distance; see `sizeWords`. */
function words(text: string, ink: string): Sprite {
  const canvas = document.createElement('canvas');
  const context = canvas.getContext('2d')!;
  const font = '600 26px system-ui, sans-serif';
  context.font = font;
  [canvas.width, canvas.height] = [Math.ceil(context.measureText(text).width) + 8, 36];
  context.font = font;
  context.fillStyle = ink;
  context.textBaseline = 'middle';
  context.fillText(text, 4, 18);
  const map = new CanvasTexture(canvas);
  // It is shown at about its own size: smaller copies would blur it.
  map.generateMipmaps = false;
  map.minFilter = LinearFilter;
  map.colorSpace = SRGBColorSpace;
  return new Sprite(new SpriteMaterial({ map, depthTest: false, sizeAttenuation: false }));
}

/** The values of some `most` ticks with their words; of less than two, those of the ends. */
export function axisTicks(first: number, last: number, most: number): [value: number, text: string][] {
  const [low, high] = [Math.min(first, last), Math.max(first, last)];
  if (!(high > low)) return [];
  if (most < 2) return [first, last].map((value) => [value, significant(value, 2)]);
  const spacing = (high - low) / most;
  const step = roundAbove(spacing);
  return ticks(low, high, spacing).map((value) => [value, tickText(value, step)]);
}

/** Lines, ticks and words of all axes; `size` is that of what is shown. */
export function axesOf(axes: Axis[], size: number, ink: string): Group {
  const group = new Group();
  const points: Vector3[] = [];
  for (const { from, to, first, last, out, label, anchor } of axes) {
    points.push(from, to);
    const along = (share: number): Vector3 => from.clone().lerp(to, share);
    const put = (text: string, share: number, x: number, y: number): void => {
      const sprite = words(text, ink);
      sprite.position.copy(along(share).addScaledVector(out, 0.02 * size));
      sprite.center.set(x, y);
      group.add(sprite);
    };
    // Of an axis that is short on the screen the ends alone can be told apart.
    const most = Math.floor(from.distanceTo(to) / (LEAST_APART * size));
    for (const [value, text] of axisTicks(first, last, Math.min(most, TICKS))) {
      const share = (value - first) / (last - first);
      points.push(along(share), along(share).addScaledVector(out, 0.015 * size));
      put(text, share, anchor[0], anchor[1] + (most < 2 ? 0.5 - share : 0));
    }
    // Beyond the last number: below a row of them, above a column.
    put(label, 1, 0.5, anchor[1] === 0.5 ? -0.8 : 1.9);
  }
  group.add(
    new LineSegments(new BufferGeometry().setFromPoints(points), new LineBasicMaterial({ color: ink })),
  );
  return group;
}

/** Gives the words their size on the screen; `px` is one px of the page at distance 1. */
export function sizeWords(group: Group, px: number): void {
  for (const part of group.children) {
    if (!(part instanceof Sprite)) continue;
    const { width, height } = part.material.map?.image as HTMLCanvasElement;
    part.scale.set((px * width) / FINE, (px * height) / FINE, 1);
  }
}

/** Gives back what the group holds on the graphics card. */
export function endAxes(group: Group): void {
  for (const part of group.children) {
    if (part instanceof Sprite) {
      part.material.map?.dispose();
      part.material.dispose();
    } else if (part instanceof LineSegments) {
      (part as LineSegments<BufferGeometry, LineBasicMaterial>).geometry.dispose();
      (part as LineSegments<BufferGeometry, LineBasicMaterial>).material.dispose();
    }
  }
}
