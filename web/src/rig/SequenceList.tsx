import { useEffect } from 'preact/hooks';
import { moment } from '../format/moment';
import { about } from '../store/results';
import { loadSequences, openSequence, sequences } from './sequences';
import { OrderButton } from './OrderButton';
import { resultOf } from './results_words';
import type { SequenceEntry } from './api';
import { onlyWatches } from './store';

function Line({ entry }: { entry: SequenceEntry }) {
  return (
    <tr>
      <th scope="row">
        {onlyWatches.value ? (
          entry.name
        ) : (
          <OrderButton act={() => void openSequence(entry.name)} why={null}>
            {entry.name}
          </OrderButton>
        )}
      </th>
      <td>{moment(entry.created)}</td>
      <td>
        {entry.frames} of {entry.planned}
      </td>
      <td>{resultOf(entry)}</td>
      <td>{entry.ended}</td>
    </tr>
  );
}

/** Which sequence to look at, while none is shown. */
export function SequenceList() {
  useEffect(() => void loadSequences(), []);
  const list = sequences.value;
  return (
    <main class="sequence-list">
      <h1>Results</h1>
      {list === null && <p class="hint">loading…</p>}
      {list?.length === 0 && <p>There is no sequence yet. Scan one.</p>}
      {list !== null && list.length > 0 && (
        <div class="wide" tabIndex={0} role="region" aria-label="List of sequences">
          <table class="list">
            <thead>
              <tr>
                <th scope="col">sequence</th>
                <th scope="col">created</th>
                <th scope="col">frames</th>
                <th scope="col">results</th>
                <th scope="col">scan ended</th>
              </tr>
            </thead>
            <tbody>
              {list.map((entry) => (
                <Line key={entry.name} entry={entry} />
              ))}
            </tbody>
          </table>
        </div>
      )}
    </main>
  );
}

/** The same as a menu in the bar, to go from one to another. */
export function SequenceMenu() {
  const shown = about.value?.sequence ?? null;
  useEffect(() => void loadSequences(), [shown]);
  if (onlyWatches.value) return <span class="sequence">{shown}</span>;
  const list = sequences.value ?? [];
  const names = list.map(({ name }) => name);
  if (shown !== null && !names.includes(shown)) names.unshift(shown);
  return (
    <select
      class="sequence-menu"
      aria-label="Sequence"
      value={shown ?? ''}
      onChange={(event) => void openSequence(event.currentTarget.value)}
    >
      {shown === null && <option value="">no sequence</option>}
      {names.map((name) => (
        <option key={name} value={name}>
          {name}
        </option>
      ))}
    </select>
  );
}
