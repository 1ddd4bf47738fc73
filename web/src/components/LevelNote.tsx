import type { LevelledInfo } from '../api';
import { significant } from '../format/number';
import { chosen, level, levelled, levelling, levellingWords } from '../store/levelled';
import { results } from '../store/results';
import { selection, tool } from '../store/selection';

function tilt({ tilt_x_mrad, tilt_y_mrad }: LevelledInfo): string {
  return `tilt x ${significant(tilt_x_mrad, 3)} mrad, y ${significant(tilt_y_mrad, 3)} mrad`;
}

/** Over the map: which points are wanted, or that the heights are not those that were measured, and the way back. */
export function LevelNote() {
  const { level: by } = selection.value;
  if (tool.value === 'points') {
    return (
      <p class="level-note" role="status">
        <span>
          Level by three points: click point {chosen.value.length + 1} of 3 on the map, or set the pin and
          press Enter.
        </span>
        <button type="button" onClick={() => (tool.value = 'pin')}>
          Cancel
        </button>
      </p>
    );
  }
  if (!by || !results.value?.geometry) return null;
  const { error } = levelling.state.value;
  const info = levelled.value?.infos.get('height');
  return (
    <p class="level-note" role="status">
      <span>
        {error ? (
          <span class="fault">Not levelled: {error}</span>
        ) : info ? (
          <>
            Heights {levellingWords(by)} ({tilt(info)} taken away); steps and files as measured.
          </>
        ) : (
          'levelling…'
        )}
      </span>
      <button type="button" onClick={() => level(null)}>
        As measured
      </button>
    </p>
  );
}
