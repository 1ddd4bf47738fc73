import type { Task } from './api';
import { rigState } from './store';
import { timeLeftText } from './texts';

const NAMES: Record<Task['kind'], string> = {
  connecting: 'Connecting',
  homing: 'Home',
  moving: 'Move',
  jogging: 'Jog',
  doctor: 'Doctor',
  scan: 'Scan',
  measuring: 'Measurement',
};

/** What the rig is doing and how far it is. Its height is always there, so that nothing jumps. */
export function JobBar() {
  const task = rigState.value?.task ?? null;
  const counted = task?.done != null && task.of !== null && task.of > 0;
  const share = counted ? Math.min(task.done! / task.of!, 1) : null;
  const details = [
    task?.step,
    counted ? `${task.done} of ${task.of}` : null,
    task?.seconds_left == null ? null : timeLeftText(task.seconds_left),
  ].filter(Boolean);
  return (
    <div class="job">
      <p>
        {/* Counts are not read out each time. */}
        <strong role="status" aria-label="Job">
          {task?.words ?? 'ready'}
        </strong>{' '}
        {details.join(' · ')}
      </p>
      {task && (
        <div
          class="progress"
          role="progressbar"
          aria-label={NAMES[task.kind]}
          aria-valuemin={0}
          aria-valuemax={100}
          aria-valuenow={share === null ? undefined : Math.round(share * 100)}
        >
          <span
            class={share === null ? 'unknown' : ''}
            style={{ width: `${share === null ? 100 : share * 100}%` }}
          />
        </div>
      )}
    </div>
  );
}
