// Why a button does nothing at the moment, and orders after which something follows.

import { computed, signal } from '@preact/signals';
import { hasToken, otherController, rigState } from '../rig/store';
import { refuse, usedLast } from '../store/notices';

/** Why this page may not give orders; null if it may. */
export const whyNot = computed<string | null>(() => {
  if (hasToken.value === null) return 'Asking whether this page may give orders.';
  if (!hasToken.value) return 'This page only watches. Orders need the first link that epirig printed.';
  if (otherController.value) return 'Another page has control. Take control on the bar first.';
  return null;
});

/** Why nothing new can be started; null if it can. */
export const whyNotStart = computed<string | null>(() => {
  const task = rigState.value?.task;
  return whyNot.value ?? (task ? `Not now: ${task.words}.` : null);
});

/** Sends an order; a refusal is told to the person. Tells whether it was taken. */
export async function taken(sent: Promise<unknown>): Promise<boolean> {
  const from = usedLast();
  try {
    await sent;
    return true;
  } catch (error) {
    refuse(error, from);
    return false;
  }
}

/** Whether the page is on the screen. Hidden pages ask for nothing. */
export const pageVisible = signal(document.visibilityState === 'visible');
document.addEventListener('visibilitychange', () => {
  pageVisible.value = document.visibilityState === 'visible';
});
