import { count, percent, significant } from '../format/number';
import { comparing, comparison, comparisonError } from '../store/comparison';
import { results, unitOf } from '../store/results';
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

/** The difference to another folder of results of the same sequence. */
export function ComparePanel() {
  const others = results.value?.others ?? [];
  if (others.length === 0) {
    return (
      <p class="hint">
        There is only one folder of results. Match the sequence again into another folder to compare.
      </p>
    );
  }
  return (
    <div>
      <h2>Compare</h2>
      <label>
        with{' '}
        <select
          value={selection.value.compare ?? ''}
          onChange={(event) => {
            const other = event.currentTarget.value || null;
            select({ compare: other });
            if (!other && selection.peek().map?.startsWith('difference')) {
              selectMap(results.peek()?.maps[0]?.id ?? '');
            }
          }}
        >
          <option value="">none</option>
          {others.map((name) => (
            <option key={name} value={name}>
              {name}
            </option>
          ))}
        </select>
      </label>
      {comparing.value && <p class="hint">comparing…</p>}
      {comparisonError.value && <p class="fault">{comparisonError.value}</p>}
      <Numbers />
    </div>
  );
}
