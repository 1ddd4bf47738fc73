// How panels and keys reach the map, without the map knowing them.

import { signal } from '@preact/signals';
import type { View } from './view';

export interface MapHandle {
  view: () => View;
  zoomBy: (factor: number) => void;
  fit: () => void;
  movePin: (dx: number, dy: number) => void;
  read: (x: number, y: number) => number | null;
}

/** The map that is on the screen. */
export const handleOf = signal<MapHandle | null>(null);

/** How many tiles have come: what `read` tells may be another value after each. */
export const tilesCome = signal(0);

/** Whether a handle of the colour bar is being moved: the map then draws faster. */
export const handleMoves = signal(false);
