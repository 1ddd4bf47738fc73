import { useEffect } from 'preact/hooks';
import type { CompareInfo } from '../api';
import { count, percent, significant } from '../format/number';
import { hasResults } from '../rig/results_words';
import { loadSequences, sequences } from '../rig/sequences';
import { comparing, comparison, comparisonError } from '../store/comparison';
import { about, results, unitOf } from '../store/results';
import { mode } from '../store/route';
import { select, selection, selectMap } from '../store/selection';

function Numbers() {
  const held = comparison.value;
  if (!held) return null;
  const { info } = held;
  const { label, factor } = unitOf(info.unit);
  const number = (value: number | null): string =>
    value === null ? 'none' : `${significant(value * factor, 3)} ${label}`;
  return (
    <>
      <table class="list">
        <caption>This minus {held.other}</caption>
        <tbody>
          <tr>
            <th scope="row">values in both</th>
            <td>{count(info.count)}</td>
          </tr>
          <tr>
            <th scope="row">mean</th>
            <td>{number(info.mean)}</td>
          </tr>
          <tr>
            <th scope="row">median</th>
            <td>{number(info.median)}</td>
          </tr>
          <tr>
            <th scope="row">standard deviation</th>
            <td>{number(info.standard_deviation)}</td>
          </tr>
          {info.in_sigma && (
            <>
              <tr>
                <th scope="row">within 1 sigma</th>
                <td>{percent(info.in_sigma.one)} (68 % if sigma is right)</td>
              </tr>
              <tr>
                <th scope="row">within 2 sigma</th>
                <td>{percent(info.in_sigma.two)} (95 % if sigma is right)</td>
              </tr>
            </>
          )}
        </tbody>
      </table>
      {info.scan && <OfScan scan={info.scan} />}
      <div class="fields">
        <button type="button" onClick={() => selectMap('difference')}>
          Show difference
        </button>
        <button type="button" onClick={() => selectMap('difference-sigma')}>
          Show difference / sigma
        </button>
        <button type="button" onClick={() => selectMap(held.map)}>
          Show {held.map}
        </button>
      </div>
    </>
  );
}

/** How another scan lay, and what of the difference is more than noise. */
function OfScan({ scan }: { scan: NonNullable<CompareInfo['scan']> }) {
  const [right, down] = scan.shift_px;
  const px = (value: number): string => significant(value, 3);
  const turned = scan.turn_deg === 0 ? '' : `, turned by ${significant(scan.turn_deg, 2)} deg`;
  return (
    <section>
      <p>
        The other scan is shifted by {px(right)} px to the right and {px(down)} px down{turned}; it was
        registered by its reference frame, and a plane was removed from the difference. The difference
        exceeds three sigma in {count(scan.places)} {scan.places === 1 ? 'place' : 'places'} of 25 px or
        more.
      </p>
    </section>
  );
}

/** Of what is chosen, only one: other results, or another sequence. */
function choose(kind: string, name: string | null): void {
  select({
    compare: kind === 'results' ? name : null,
    compareSequence: kind === 'sequence' ? name : null,
  });
  if (name === null && selection.peek().map?.startsWith('difference')) {
    selectMap(results.peek()?.maps[0]?.id ?? '');
  }
}

/** The difference to other results of the same sequence, or to another sequence. */
export function ComparePanel() {
  const of = results.value;
  const shown = about.value?.sequence ?? null;
  const isRig = mode.value === 'ui';
  useEffect(() => {
    if (isRig) void loadSequences();
  }, [isRig, shown]);
  const { compare, compareSequence } = selection.value;
  const others = of?.others ?? [];
  const known = isRig && of?.geometry ? (sequences.value ?? []) : [];
  const scans = known.filter((entry) => hasResults(entry) && entry.name !== shown).map(({ name }) => name);
  if (compareSequence !== null && !scans.includes(compareSequence)) scans.unshift(compareSequence);
  if (others.length === 0 && scans.length === 0) {
    return (
      <p class="hint">
        There is only one folder of results. Match the sequence again into another folder to compare.
      </p>
    );
  }
  const options = (kind: string, names: string[]) =>
    names.map((name) => (
      <option key={name} value={`${kind}/${name}`}>
        {name}
      </option>
    ));
  const value = compareSequence !== null ? `sequence/${compareSequence}` : `results/${compare ?? ''}`;
  return (
    <div>
      <h2>Compare</h2>
      <label>
        with{' '}
        <select
          value={value}
          onChange={(event) => {
            const [kind = '', ...name] = event.currentTarget.value.split('/');
            choose(kind, name.join('/') || null);
          }}
        >
          <option value="results/">none</option>
          {others.length > 0 && (
            <optgroup label="results of this sequence">{options('results', others)}</optgroup>
          )}
          {scans.length > 0 && <optgroup label="other sequences">{options('sequence', scans)}</optgroup>}
        </select>
      </label>
      {comparing.value && <p class="hint">comparing…</p>}
      {comparisonError.value && <p class="fault">{comparisonError.value}</p>}
      <Numbers />
    </div>
  );
}
