// Looking for the corners of a target in the live picture.

import { computed } from '@preact/signals';
import { refuse } from '../store/notices';
import { rig } from './api';
import { order, rigState } from './store';
import { whyNoCamera } from './why';

/** Whether the server looks for a target. */
export const looking = computed(() => rigState.value?.target != null);

export function toggleTarget(): void {
  const why = whyNoCamera.peek();
  if (why !== null) refuse(`Off: ${why}`, null);
  else void order(rig.findTarget(!looking.peek()));
}
