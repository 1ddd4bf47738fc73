import { clipMarks } from '../store/settings';

/** Whether values beyond the range are striped. */
export function ClipSwitch() {
  return (
    <label class="check" title="Stripes where values are beyond the range">
      <input
        type="checkbox"
        checked={clipMarks.value === 'on'}
        onChange={(event) => (clipMarks.value = event.currentTarget.checked ? 'on' : 'off')}
      />
      clipped
    </label>
  );
}
