import { useSignal } from '@preact/signals';
import { rig } from './api';
import { OrderButton } from './OrderButton';
import { Section } from './Section';
import { onlyWatches, order, rigState } from './store';
import { whyNoCamera } from './why';

const SHOWN = [
  ['object', 'object'],
  ['dark', 'cap'],
  ['flat', 'white'],
  ['board', 'board'],
] as const;

/** What a simulated camera looks at. */
export function SimulatedPane() {
  const pose = useSignal(0);
  if (!rigState.value?.camera.simulated || onlyWatches.value) return null;
  const show = (what: (typeof SHOWN)[number][0]): void => {
    const posed = what === 'board' ? pose.peek() : 0;
    if (what === 'board') pose.value += 1;
    void order(rig.show(what, posed));
  };
  return (
    <Section title="Simulated rig">
      <p class="buttons" role="group" aria-label="Show">
        show:
        {SHOWN.map(([what, words]) => (
          <OrderButton key={what} act={() => show(what)} why={whyNoCamera.value}>
            {words}
          </OrderButton>
        ))}
      </p>
      <p class="note muted">Each press on "board" shows its next pose.</p>
    </Section>
  );
}
