import type { RegionInfo } from '../api';
import { RegionFields } from '../components/RegionFields';
import { count, measured, percent, toPlaces } from '../format/number';
import { level, levelled } from '../store/levelled';
import { inRegion } from '../store/questions';
import { lengths, results } from '../store/results';
import { region, tool } from '../store/selection';

type Row = [name: string, text: string, words: string];

function rowsOf(info: RegionInfo): Row[] {
  const { label, factor } = lengths.value;
  const { roughness } = info;
  const digits = label === 'mm' ? 4 : 1;
  const sized = (value_mm: number): string => `${toPlaces(value_mm * factor, digits)} ${label}`;
  // Without a sigma, as far as tilts of a rig are ever set.
  const tilt = (value: number, sigma: number | null): string =>
    sigma === null ? `${toPlaces(value, 3)} mrad, sigma unknown` : measured(value, sigma, 'mrad');
  const mean_sigma = info.mean_sigma_mm === null ? null : info.mean_sigma_mm * factor;
  return [
    ['mean height', measured(info.mean_mm * factor, mean_sigma, label), ''],
    ['tilt along x', tilt(info.tilt_x_mrad, info.tilt_x_sigma_mrad), 'right side up is positive'],
    ['tilt along y', tilt(info.tilt_y_mrad, info.tilt_y_sigma_mrad), 'lower side up is positive'],
    ['Sa', sized(roughness.sa_mm), 'mean distance from the plane'],
    ['Sq', sized(roughness.sq_mm), 'root mean square'],
    ['Sz', sized(roughness.sz_mm), 'lowest to highest pixel; none is left out'],
    [
      'pixels answered',
      `${count(roughness.pixels)} of ${count(info.pixels)}`,
      percent(roughness.pixels / info.pixels),
    ],
  ];
}

function Numbers({ of }: { of: RegionInfo }) {
  return (
    <>
      <table class="list">
        <caption>About the least-squares plane of the region (ISO 25178-2)</caption>
        <tbody>
          {rowsOf(of).map(([name, text, words]) => (
            <tr key={name}>
              <th scope="row">{name}</th>
              <td>{text}</td>
              <td class="muted">{words}</td>
            </tr>
          ))}
        </tbody>
      </table>
      <p class="muted note">
        sigma is the standard uncertainty (k = 1) by the scatter between independent parts of the region. It
        holds no error that all heights share, such as that of the scale.
      </p>
    </>
  );
}

/** Who uses the keyboard goes on on the map. */
function choosePoints(): void {
  tool.value = 'points';
  document.getElementById('map')?.focus();
}

function LevelBy() {
  const part = region.value;
  return (
    <div class="fields" role="group" aria-label="Level the heights">
      <button
        type="button"
        disabled={!part}
        title={part ? undefined : 'Draw a region first'}
        onClick={() => part && level({ region: part })}
      >
        Level by the region
      </button>
      <button type="button" onClick={choosePoints}>
        Level by three points
      </button>
    </div>
  );
}

/** A region of the heights in numbers, whatever it shows; and levelling by it. */
export function RegionPanel() {
  const { value, error, loading } = inRegion.state.value;
  const held = results.value;
  if (!held?.geometry)
    return <p class="hint">Heights need a calibration, so there are no numbers in mm.</p>;
  const map = held.maps.find(({ id }) => id === inRegion.state.value.key?.map);
  return (
    <div class={loading ? 'loading' : ''}>
      <h2>{map ? `${map.title} in the region` : 'Heights in a region'}</h2>
      {levelled.value && <p>Heights are {levelled.value.words}.</p>}
      <RegionFields />
      <LevelBy />
      {error && (
        <p class="fault" role="alert">
          {error}
        </p>
      )}
      {loading && !value && <p class="hint">computing…</p>}
      {region.value && value && !error && <Numbers of={value} />}
    </div>
  );
}
