import type { Task } from './api';
import { onlyWatches, rigState } from './store';
import { timeLeftText } from './texts';
import { whyNoOrders } from './why';

const NAMES: Record<Task['kind'], string> = {
  connecting: 'Connecting',
  homing: 'Home',
  moving: 'Move',
  jogging: 'Jog',
  doctor: 'Doctor',
  scan: 'Scan',
  measuring: 'Measurement',
};

/**
 * What the rig is doing and how far it is, or why nothing can be done. Its height is always the same: what is
 * below must not move away from a finger.
 */
export function JobBar() {
  const task = rigState.value?.task ?? null;
  const counted = task?.done != null && task.of !== null && task.of > 0;
  const share = counted ? Math.min(task.done! / task.of!, 1) : null;
  const why = whyNoOrders.value;
  const details = [
    task?.step,
    counted ? `${task.done} of ${task.of}` : null,
    task?.seconds_left == null ? null : timeLeftText(task.seconds_left),
    task && why !== null && why !== task.words && !onlyWatches.value ? `controls are off: ${why}` : null,
  ].filter(Boolean);
  const idle =
    why === null ? 'ready' : onlyWatches.value ? 'nothing is under way' : `Controls are off: ${why}`;
  return (
    <div class="job">
      <p>
        {/* Counts are not read out each time. */}
        <strong role="status" aria-label="Job">
          {task?.words ?? idle}
        </strong>{' '}
        {details.join(' · ')}
      </p>
      <div class={`progress ${task ? '' : 'none'}`}>
        {task && (
          <span
            class={share === null ? 'unknown' : ''}
            style={{ width: `${share === null ? 100 : share * 100}%` }}
            role="progressbar"
            aria-label={NAMES[task.kind]}
            aria-valuemin={0}
            aria-valuemax={100}
            aria-valuenow={share === null ? undefined : Math.round(share * 100)}
          />
        )}
      </div>
    </div>
  );
}
