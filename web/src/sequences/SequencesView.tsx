import { useEffect } from 'preact/hooks';
import { loadSequences, sequences } from '../rig/sequences';
import { onlyWatches, rigState } from '../rig/store';
import { plural } from '../scan/words';
import { SequenceTable } from './SequenceTable';
import { chosen, compare, filter, pair, rows } from './store';
import { TrendPane } from './TrendPane';
import '../style/sequences.css';

function CompareButton() {
  const both = pair.value;
  // To compare means to open one of both, which a page that only watches cannot.
  if (onlyWatches.value) return null;
  const [only] = chosen.value;
  const words = both
    ? `${both[0]} minus ${both[1]}`
    : only !== undefined
      ? `${only} is chosen; choose another one.`
      : 'Choose two in the table.';
  return (
    <>
      <button
        type="button"
        disabled={both === null}
        title={both === null ? words : undefined}
        onClick={() => both && void compare(both)}
      >
        Compare
      </button>
      <span class="muted compare-words">{words}</span>
    </>
  );
}

function Tools({ count }: { count: number }) {
  const shown = rows.value.length;
  return (
    <div class="sequence-tools">
      <input
        type="search"
        aria-label="Filter by name, day, state or verdict"
        placeholder="filter: name, day, state, verdict"
        value={filter.value}
        onInput={(event) => (filter.value = event.currentTarget.value)}
      />
      <span role="status">
        {shown === count ? plural(count, 'sequence') : `${shown} of ${plural(count, 'sequence')}`}
      </span>
      <CompareButton />
    </div>
  );
}

/** All sequences below the folder: a table, any two compared, and how steady they are. */
export function SequencesView() {
  // When a task has ended, there may be others, or other results.
  const when = rigState.value?.task?.kind ?? 'idle';
  useEffect(() => void loadSequences(), [when]);
  const list = sequences.value;
  return (
    <main class="sequence-view">
      <h1 class="unseen">Sequences</h1>
      {list === null && (
        <p class="hint" role="status">
          loading…
        </p>
      )}
      {list?.length === 0 && <p>There is no sequence yet. Scan one.</p>}
      {list !== null && list.length > 0 && (
        <>
          <section class="sequence-pane" aria-label="Sequences">
            <Tools count={list.length} />
            <SequenceTable />
          </section>
          <TrendPane />
        </>
      )}
    </main>
  );
}
