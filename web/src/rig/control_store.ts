// The controls of the camera: asked for anew when the camera or its settings have changed.

import { computed, effect, signal } from '@preact/signals';
import { rig, type Control } from './api';
import { order, rigState } from './store';
import { titleOf, valueText } from './texts';
import { say } from '../store/notices';

export const controls = signal<Control[] | null>(null);

/** Changes when the controls may have changed; pictures per second do not count. */
const cameraKey = computed(() => {
  const camera = rigState.value?.camera;
  if (!camera || camera.state === 'lost' || camera.state === 'connecting') return null;
  return [camera.name, camera.state, camera.exposure_us, camera.rate_hz, camera.rows].join(' ');
});

/** Follows the controls while somebody looks at them; returns how to end that. */
export function followControls(): () => void {
  let round = 0;
  return effect(() => {
    if (cameraKey.value === null) return;
    const mine = (round += 1);
    rig.controls().then(
      (list) => {
        if (mine === round) controls.value = list;
      },
      () => undefined,
    );
  });
}

/** Sets a control. Others may follow it, so the answer is the whole list. */
export async function setControl(name: string, value: number): Promise<void> {
  const list = await order(rig.setControl(name, String(value)));
  const taken = list?.find((control) => control.name === name);
  if (taken?.kind === 'integer' && taken.value !== null && taken.value !== value) {
    const [asked, set] = [value, taken.value].map((one) => valueText(name, one));
    say(`${titleOf(name)}: the camera has set ${set} in place of ${asked}`);
  }
  // After a refusal the old list is shown once more, so that a field falls back.
  controls.value = list ?? [...(controls.peek() ?? [])];
}
