import { rig } from './api';
import { age_ms } from './picture_store';
import { askForToken, hasToken, mayControl, order, otherController, rigState } from './store';
import { ageText, diskText, freshness } from './texts';

/** Who gives orders. */
function Control() {
  const name = rigState.value?.rig ?? '';
  const of = name ? `${name}, ` : '';
  const other = otherController.value !== null && hasToken.value === true;
  const mine = rigState.value?.controller != null;
  const words =
    hasToken.value === null
      ? 'connecting'
      : mayControl.value
        ? mine
          ? 'you control'
          : 'nobody controls'
        : other
          ? 'another page has control'
          : 'watching: this page can only look and stop';
  const free = mayControl.value && !mine ? 'The first order takes control.' : null;
  return (
    <span class="bar-line">
      <span class="who" title={free ?? of + words}>
        {of}
        {words}
      </span>
      {other && (
        <button type="button" onClick={() => void order(rig.take()).then(askForToken)}>
          Take control
        </button>
      )}
    </span>
  );
}

/** How often pictures come, and how old the last one is. */
function Pictures() {
  const camera = rigState.value?.camera;
  if (!camera) return null;
  const old = age_ms.value;
  if (camera.state === 'lost') return <span class="bar-rate fault">camera lost</span>;
  const rate = camera.picture_hz === null ? '' : ` ${camera.picture_hz.toFixed(1)} Hz`;
  const fresh = old === null ? 'live' : freshness(old);
  return (
    <span class={`bar-rate ${fresh === 'live' ? '' : 'amber'}`}>
      {camera.state}
      {rate}
      {old !== null && `, ${fresh === 'live' ? '' : '! '}${ageText(old)} old`}
    </span>
  );
}

function Disk() {
  const state = rigState.value;
  if (!state || state.free_bytes === null) return null;
  const need = state.scan?.needs_bytes ?? null;
  const low = need !== null && state.free_bytes < 1.5 * need;
  return (
    <span class={`bar-disk ${low ? 'amber' : ''}`}>
      {low && '! '}
      {diskText(state.free_bytes)} free
    </span>
  );
}

/** What the bar tells of the rig on every view. */
export function BarStatus() {
  return (
    <span class="bar-status">
      <Control />
      <span class="bar-line">
        <Pictures />
        <Disk />
      </span>
    </span>
  );
}
