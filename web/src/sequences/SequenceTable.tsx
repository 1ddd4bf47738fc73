import { useEffect, useRef, useState } from 'preact/hooks';
import { VERDICT_COLOURS } from '../components/verdict';
import { minute, moment } from '../format/moment';
import { OrderButton } from '../rig/OrderButton';
import { depthOf } from '../rig/results_words';
import { onlyWatches } from '../rig/store';
import { openResults } from '../scan/JobCard';
import { about } from '../store/results';
import type { SequenceEntry } from '../types';
import { onScreen, type Column } from './rows';
import { choose, chosen, isComparable, rows, sortBy, sorting } from './store';
import { Thumbnail } from './Thumbnail';

/** All rows have one height, so that it is known which of a thousand are on the screen. */
const ROW_PX = 56;

const MOST_CHOSEN = 2;

const COLUMNS: [column: Column, words: string][] = [
  ['name', 'sequence'],
  ['created', 'begun'],
  ['state', 'state'],
  ['depth', 'depth (95 %)'],
  ['verdict', 'verdict'],
];

function Head({ column, words }: { column: Column; words: string }) {
  const { column: by, descending } = sorting.value;
  const direction = descending ? 'descending' : 'ascending';
  return (
    <th scope="col" class={`of-${column}`} aria-sort={by === column ? direction : 'none'}>
      <button type="button" class="plain" onClick={() => sortBy(column)}>
        {words}
        <span aria-hidden="true">{by === column ? (descending ? ' ▼' : ' ▲') : ''}</span>
      </button>
    </th>
  );
}

function Choice({ entry }: { entry: SequenceEntry }) {
  const { name } = entry;
  const on = chosen.value.includes(name);
  if (!isComparable(entry) && !on) return null;
  const full = !on && chosen.value.length >= MOST_CHOSEN;
  return (
    <label class="choice" title={full ? 'Two are chosen: take the tick of one away first.' : undefined}>
      <input
        type="checkbox"
        aria-label={`Choose ${name} to compare`}
        checked={on}
        disabled={full}
        onChange={(event) => choose(name, event.currentTarget.checked)}
      />
    </label>
  );
}

function Name({ entry: { name, created, state, problem } }: { entry: SequenceEntry }) {
  const shown = about.value?.sequence === name;
  const opens = state !== 'unreadable' && !onlyWatches.value;
  return (
    <>
      <span class="row-name" title={name}>
        {opens ? (
          <OrderButton kind="plain" act={() => void openResults(name)} why={null}>
            {name}
          </OrderButton>
        ) : (
          name
        )}
        {shown && <span class="muted"> (open)</span>}
      </span>
      {problem !== null ? (
        <small class="fault" title={problem}>
          {problem}
        </small>
      ) : (
        <small class="muted narrow-only">
          {minute(created)}, {state}
        </small>
      )}
    </>
  );
}

function Verdict({ verdict }: { verdict: SequenceEntry['verdict'] }) {
  if (verdict === null) return null;
  return <strong class={`row-verdict ${VERDICT_COLOURS[verdict]}`}>{verdict.toUpperCase()}</strong>;
}

function Row({ entry, number }: { entry: SequenceEntry; number: number }) {
  return (
    <tr aria-rowindex={number} style={{ height: `${ROW_PX}px` }}>
      <td>
        <Choice entry={entry} />
      </td>
      <td>
        <Thumbnail entry={entry} />
      </td>
      <th scope="row" class="of-name">
        <Name entry={entry} />
      </th>
      <td class="of-created" title={moment(entry.created)}>
        {minute(entry.created)}
      </td>
      <td class="of-state">{entry.state}</td>
      <td class="of-depth">{depthOf(entry)}</td>
      <td class="of-verdict">
        <Verdict verdict={entry.verdict} />
      </td>
    </tr>
  );
}

/** The place of rows that are not drawn. */
function Gap({ count }: { count: number }) {
  if (count === 0) return null;
  return (
    <tr aria-hidden="true" style={{ height: `${count * ROW_PX}px` }}>
      <td />
    </tr>
  );
}

/** A table of sequences. Only rows on the screen are drawn. */
export function SequenceTable() {
  const box = useRef<HTMLDivElement>(null);
  const [seen, setSeen] = useState({ top: 0, height: 0 });
  const look = (): void => {
    const { scrollTop: top, clientHeight: height } = box.current!;
    setSeen((before) => (before.top === top && before.height === height ? before : { top, height }));
  };
  useEffect(() => {
    const observer = new ResizeObserver(look);
    observer.observe(box.current!);
    return () => observer.disconnect();
  }, []);
  const all = rows.value;
  // Another order begins at its first row; so does another choice of rows.
  const order = `${sorting.value.column} ${sorting.value.descending}`;
  useEffect(() => box.current?.scrollTo(0, 0), [order]);
  const [first, after] = onScreen(all.length, ROW_PX, seen.top, seen.height);
  return (
    <div
      ref={box}
      class="sequence-rows"
      tabIndex={0}
      role="region"
      aria-label="List of sequences"
      onScroll={look}
    >
      <table class="list" aria-rowcount={all.length + 1}>
        <thead>
          <tr aria-rowindex={1}>
            <th scope="col" class="of-choice">
              <span class="unseen">compare</span>
            </th>
            <th scope="col" class="of-picture">
              <span class="unseen">picture</span>
            </th>
            {COLUMNS.map(([column, words]) => (
              <Head key={column} column={column} words={words} />
            ))}
          </tr>
        </thead>
        <tbody>
          <Gap count={first} />
          {all.slice(first, after).map((entry, index) => (
            <Row key={entry.name} entry={entry} number={first + index + 2} />
          ))}
          <Gap count={all.length - after} />
        </tbody>
      </table>
    </div>
  );
}
