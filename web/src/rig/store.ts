// The rig as the server last told it.

import { computed, signal } from '@preact/signals';
import { ApiError } from '../api';
import { contactFailed, contactMade } from '../store/contact';
import { refuse, usedLast } from '../store/notices';
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

/** How often the state of the rig was asked for in vain; 0 while it comes. */
export const tries = computed(() => stateFeed.value?.tries.value ?? 0);

const AGAIN_MS = 2000;

/** Whether this page can only look, and stop. What it cannot do is not offered. */
export const onlyWatches = computed(() => hasToken.value === false);

/** Finds out whether this page has the token. Only the server's own "no" means that it has not. */
export async function askForToken(): Promise<void> {
  try {
    await rig.hello();
    hasToken.value = true;
  } catch (error) {
    if (error instanceof ApiError) hasToken.value = false;
    else setTimeout(() => void askForToken(), AGAIN_MS);
  }
}

/** Follows the rig; for pages of `epirig ui` only. Once is enough. */
export function followRig(): void {
  if (stateFeed.peek()) return;
  const feed = openFeed(`api/rig/state/${client}`, (message) => {
    if (typeof message === 'string') rigState.value = JSON.parse(message) as RigState;
  });
  stateFeed.value = feed;
  // A lost feed is a lost server, and it is known sooner than by asking.
  feed.tries.subscribe((count) => (count === 0 ? contactMade() : contactFailed()));
  void askForToken();
}

/** Sends an order; a refusal is told beside what it came from. */
export async function order<T>(sent: Promise<T>): Promise<T | null> {
  const from = usedLast();
  try {
    return await sent;
  } catch (error) {
    refuse(error, from);
    return null;
  }
}
