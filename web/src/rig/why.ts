// Why an order would be refused. Buttons that would be refused are off, and say this.

import { computed } from '@preact/signals';
import type { CameraState, StageState } from './api';
import { hasToken, mayControl, otherController, rigState, tries } from './store';

/** Why this page only watches; null if it may give orders. */
export const whyWatching = computed<string | null>(() => {
  if (hasToken.value === false) return 'this page only watches: it was not opened with the link for orders';
  if (otherController.value !== null) return 'another page has control';
  return mayControl.value ? null : 'connecting';
});

/** Why no order can be given at all; null if orders can be given. */
export const whyNoOrders = computed<string | null>(() => {
  const state = rigState.value;
  if (tries.value > 0) return 'no contact with the server';
  if (!state) return 'connecting';
  if (whyWatching.value !== null) return whyWatching.value;
  if (state.stopping) return 'stopping';
  return state.task?.words ?? null;
});

/** Why something cannot be used that is not there. */
function whyNotThere(name: string, state: CameraState['state'] | StageState['state']): string | null {
  if (state === 'lost') return `the ${name} is lost`;
  return state === 'connecting' ? `the ${name} is not connected yet` : null;
}

export const whyNoCamera = computed<string | null>(
  () => whyNoOrders.value ?? whyNotThere('camera', rigState.value?.camera.state ?? 'connecting'),
);

export const whyNoStage = computed<string | null>(
  () => whyNoOrders.value ?? whyNotThere('stage', rigState.value?.stage.state ?? 'connecting'),
);

/** Moves by a known length need a known position. */
export const whyNoMove = computed<string | null>(
  () => whyNoStage.value ?? (rigState.value?.stage.homed ? null : 'not homed: hold Home first'),
);
