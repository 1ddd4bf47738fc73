// STOP: one press, no question, from anywhere. A late STOP does no harm, so it is sent until it arrives.

import { signal } from '@preact/signals';
import { ApiError } from '../api';
import { refuse } from '../store/notices';
import { rig } from './api';
import { held, jog } from './jogging';
import { rigState, tries } from './store';

/** Whether a STOP of this page is on its way, and whether it is known not to arrive. */
export const stopSent = signal<'no' | 'sent' | 'failing'>('no');

const AGAIN_MS = 400;
const PATIENCE_MS = 1000;
const REPLY_MS = 2000;
const TRIES = 25;

let running = 0;

function silence(): Promise<never> {
  return new Promise((_, reject) => setTimeout(() => reject(new Error('no reply')), REPLY_MS));
}

/** Stops all motion; a scan is paused. */
export async function stop(): Promise<void> {
  jog.end();
  const mine = (running += 1);
  const tell = (state: 'no' | 'sent' | 'failing'): void => {
    if (running === mine) stopSent.value = state;
  };
  tell('sent');
  const late = setTimeout(() => tell('failing'), PATIENCE_MS);
  for (let tried = 1; tried <= TRIES && running === mine; tried += 1) {
    try {
      await Promise.race([rig.stop(), silence()]);
      tell('no');
      break;
    } catch (error) {
      if (error instanceof ApiError) {
        tell('no');
        refuse(`STOP was refused: ${error.message}`, null);
        break;
      }
      tell('failing');
      await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
    }
  }
  clearTimeout(late);
}

/**
 * Esc and Pause stop, wherever the focus is: before a dialog closes, before a field forgets its text. Where
 * nothing is under way, Esc in a dialog closes it and is no STOP.
 */
export function listenForStop(): void {
  addEventListener(
    'keydown',
    (event) => {
      if (event.repeat || (event.key !== 'Escape' && event.key !== 'Pause')) return;
      const closes = event.key === 'Escape' && document.querySelector('dialog[open]') !== null;
      const { task, stage } = rigState.peek() ?? {};
      const rests = task === null && stage?.moving === false && held.peek() === null;
      // Without contact nobody knows whether something is under way.
      if (closes && rests && tries.peek() === 0) return;
      void stop();
    },
    { capture: true },
  );
}
