import { moment } from '../format/moment';
import { percent, significant } from '../format/number';
import { results } from '../store/results';

/** What was matched, with what, and how many pixels were answered. */
export function SummaryPanel() {
  const held = results.value;
  if (!held) return null;
  const { sequence, results: matched, geometry } = held;
  const answers = held.maps.find(({ id }) => id === 'mask')?.classes ?? [];
  const rows: [string, string][] = [
    ['sequence', sequence.name],
    ['created', moment(sequence.created)],
    [
      'frames',
      `${sequence.frames} of ${sequence.columns} × ${sequence.rows} px, ${sequence.bit_depth} bit`,
    ],
    ['origin', sequence.origin],
    ['scan ended', sequence.end_in_words ?? sequence.ended],
  ];
  if (geometry) {
    rows.push(['distance', `${significant(geometry.distance_mm, 6)} mm`]);
    rows.push(['pixel on the surface', `${significant(geometry.pixel_mm, 4)} mm`]);
  }
  if (matched) {
    rows.push(
      ['results', `${matched.name}${matched.quick ? ' (quick)' : ''}, ${matched.program}`],
      ['calibrated', matched.calibrated ? 'yes' : 'no'],
      ['positions from', matched.positions],
      ['reference frame', String(matched.reference)],
      [
        'disparities searched',
        `${significant(matched.minimum_px, 4)} to ${significant(matched.maximum_px, 4)} px`,
      ],
      ...answers.map(({ name, share }): [string, string] => [name, percent(share)]),
    );
    // Results of an earlier version do not tell it.
    if (matched.object > 0) {
      rows.push([
        'object',
        `${percent(matched.object)}, ${percent(matched.object_answered)} of it answered`,
      ]);
    }
    if (matched.median_sigma_px !== null) {
      rows.push(['median sigma', `${significant(matched.median_sigma_px, 2)} px`]);
    }
    rows.push(['time', `${significant(matched.seconds, 3)} s`]);
  }
  return (
    <div>
      <h2>About</h2>
      <table class="list">
        <tbody>
          {rows.map(([name, value]) => (
            <tr key={name}>
              <th scope="row">{name}</th>
              <td>{value}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
