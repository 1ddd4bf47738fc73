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

/** Whether a handle of the colour bar is being moved: the map then draws faster. */
export const handleMoves = signal(false);
