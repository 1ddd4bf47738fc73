// The jog of this page, with all that ends it.

import { effect, signal } from '@preact/signals';
import { keySheetOpen } from '../store/actions';
import { refuse } from '../store/notices';
import { view } from '../store/route';
import { rig } from './api';
import { attended, watchAttention } from './attention';
import { Jog, type Held } from './jog';
import { mayControl, rigState, tries } from './store';

/** What is held now. */
export const held = signal<Held | null>(null);

/** Whether the jog buttons move fast. */
export const fast = signal(false);

function allowed(): boolean {
  const state = rigState.peek();
  const there = state?.stage.state === 'ready' && !state.stopping;
  return there && mayControl.peek() && tries.peek() === 0 && view.peek() === 'rig' && attended();
}

export const jog = new Jog(
  rig,
  allowed,
  (now) => (held.value = now),
  (fault) => refuse(fault),
);

/** Call it once. Each hold ends when attention, view, contact or control are lost. */
export function guardJog(): void {
  watchAttention(() => jog.end());
  effect(() => {
    const stage = rigState.value?.stage.state;
    const open = keySheetOpen.value || view.value !== 'rig' || tries.value > 0 || !mayControl.value;
    if (open || stage !== 'ready' || rigState.value?.stopping) jog.end();
  });
}
