import { rigState } from './store';
import { stop, stopSent } from './stopping';

/** Stops all motion at once. It is never off: a STOP too many does no harm. */
export function StopButton() {
  const pressed = rigState.value?.stopping === true || stopSent.value !== 'no';
  return (
    <button
      type="button"
      class="stop"
      aria-label="STOP"
      aria-pressed={pressed}
      aria-keyshortcuts="Escape Pause"
      title="Stop all motion (Esc)"
      onClick={() => void stop()}
    >
      STOP <small>(Esc)</small>
    </button>
  );
}
