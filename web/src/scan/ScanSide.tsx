import type { RigState, ScanState } from '../rig/api';
import { percent, significant } from '../format/number';
import { CameraPicture } from './CameraPicture';
import { Fold } from './Fold';
import { StopCharts } from './StopCharts';
import { DISK_WORDS, diskText, diskVerdict, millimetres, plural, positionError } from './words';

function LastFrame({ scan }: { scan: ScanState }) {
  const stop = scan.stops[scan.stops.length - 1];
  if (!stop) return <p class="hint">no frame yet</p>;
  return (
    <table class="values">
      <tbody>
        <tr>
          <th scope="row">attempts</th>
          <td>{stop.attempts}</td>
        </tr>
        <tr>
          <th scope="row">reported {'\u2212'} planned</th>
          <td>{positionError(stop.reported_mm, stop.planned_mm)}</td>
        </tr>
        <tr>
          <th scope="row">saturated</th>
          <td>{percent(stop.saturated)}</td>
        </tr>
        <tr>
          <th scope="row">mean light</th>
          <td>{significant(stop.mean_dn, 4)} DN</td>
        </tr>
      </tbody>
    </table>
  );
}

function Retakes({ retakes }: { retakes: ScanState['retakes'] }) {
  return (
    <ul class="scan-retakes">
      {retakes.map(({ index, attempt, reason }) => (
        <li key={`${index} ${attempt}`}>
          frame {index}, attempt {attempt}: {reason}
        </li>
      ))}
    </ul>
  );
}

/** Where the stage is, and whether there is room on the disk. */
function Places({ scan, state }: { scan: ScanState; state: RigState }) {
  const { stage } = state;
  const stop = scan.stops[scan.stops.length - 1];
  const free = scan.free_bytes ?? state.free_bytes;
  const verdict = diskVerdict(scan.needs_bytes, free);
  return (
    <table class="values scan-places">
      <tbody>
        <tr>
          <th scope="row">Stage</th>
          <td>
            {stage.position_mm === null ? 'position not known' : `${millimetres(stage.position_mm)} mm`}
            {stop && (
              <span class="muted">
                {' '}
                last stop {millimetres(stop.planned_mm)} mm{' '}
                {positionError(stop.reported_mm, stop.planned_mm)}
              </span>
            )}
          </td>
        </tr>
        <tr>
          <th scope="row">Disk</th>
          <td class={`disk ${verdict}`}>
            {DISK_WORDS[verdict] && <b>{DISK_WORDS[verdict]} </b>}
            {diskText(scan.needs_bytes, free)}
          </td>
        </tr>
      </tbody>
    </table>
  );
}

/** The scan in numbers. */
export function ScanSide({ scan, state }: { scan: ScanState; state: RigState }) {
  const last = scan.stops[scan.stops.length - 1];
  const { retakes } = scan;
  return (
    <div class="scan-side">
      <Places scan={scan} state={state} />
      <Fold title="Last frame" brief={last ? `frame ${last.index}, counted from 0` : ''}>
        <div class="last-frame">
          <LastFrame scan={scan} />
          {!scan.asked && <CameraPicture name="Last frame" live={false} />}
        </div>
      </Fold>
      <Fold title="Retakes" brief={retakes.length === 0 ? 'none' : plural(retakes.length, 'retake')}>
        {retakes.length > 0 ? (
          <Retakes retakes={retakes} />
        ) : (
          <p class="hint">Every frame was good at once.</p>
        )}
      </Fold>
      <Fold title="Stops" brief={`${scan.stops.length} of ${scan.planned}`}>
        <StopCharts stops={scan.stops} />
      </Fold>
    </div>
  );
}
