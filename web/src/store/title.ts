// Keeps the title of the page.

import { effect } from '@preact/signals';
import { titleOf } from '../format/title';
import { rigState } from '../rig/store';
import { about, results } from './results';
import { mode, view } from './route';

export function followTitle(): void {
  effect(() => {
    const sequence = results.value?.sequence.name ?? about.value?.sequence ?? null;
    document.title = titleOf(view.value, sequence, mode.value === 'ui' ? rigState.value : null);
  });
}
