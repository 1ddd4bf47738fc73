// The rig as the server last told it.

import { computed, signal } from '@preact/signals';
import { say } from '../store/actions';
import { client, rig, type RigState } from './api';
import { openFeed, type Feed } from './socket';

export const rigState = signal<RigState | null>(null);

/** Whether this page has the token; null until that is known. */
export const hasToken = signal<boolean | null>(null);

/** Another page that has control, if there is one. */
export const otherController = computed(() => {
  const held = rigState.value?.controller ?? null;
  return held === client ? null : held;
});

/** Whether buttons of this page move and set something. */
export const mayControl = computed(() => hasToken.value === true && otherController.value === null);

export const stateFeed = signal<Feed | null>(null);

/** Follows the rig; for pages of `epirig ui` only. */
export function followRig(): void {
  stateFeed.value = openFeed('api/rig/state', (message) => {
    if (typeof message === 'string') rigState.value = JSON.parse(message) as RigState;
  });
  rig.hello().then(
    () => (hasToken.value = true),
    () => (hasToken.value = false),
  );
}

/** Sends an order; a refusal is told to the person. */
export async function order<T>(sent: Promise<T>): Promise<T | null> {
  try {
    return await sent;
  } catch (error) {
    say(error instanceof Error ? error.message : String(error));
    return null;
  }
}
