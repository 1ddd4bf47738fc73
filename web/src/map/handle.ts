// How panels and keys reach the map, without the map knowing them.

import { signal } from '@preact/signals';
import type { View } from './view';

export interface MapHandle {
  view: () => View;
  zoomBy: (factor: number) => void;
  fit: () => void;
  movePin: (dx: number, dy: number) => void;
}

/** The map that is on the screen. */
export const handleOf = signal<MapHandle | null>(null);

/** What is on the screen as a picture. */
export interface Picture {
  picture: HTMLCanvasElement;
  /** Pixels of `picture` per px of the page. */
  devicePixels: number;
  /** What is to be known of it. */
  words: string[];
  /** Whether its colours are those of the colour bar. */
  coloured: boolean;
  /** Whether it is the surface in 3-D. */
  solid: boolean;
}

/** Makes a picture of the map or the surface, whichever is on the screen. */
export const pictureOf = signal<(() => Picture | null) | null>(null);

/** Whether a handle of the colour bar is being moved: the map then draws faster. */
export const handleMoves = signal(false);
