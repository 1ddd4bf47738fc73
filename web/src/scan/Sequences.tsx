import { moment } from '../format/moment';
import { rig, type SequenceEntry } from '../rig/api';
import { hasResults, resultOf } from '../rig/results_words';
import { order } from '../rig/store';
import { whyNot, whyNotStart } from './control';
import { openResults, Order, Reason } from './JobCard';

function Entry({ entry }: { entry: SequenceEntry }) {
  const { name, created, frames, planned, ended, can_be_resumed } = entry;
  const measured = hasResults(entry);
  return (
    <li>
      <div class="entry-words">
        <b>{name}</b>
        <span class="muted note">{moment(created)}</span>
        <span class="note">
          {frames} of {planned} frames, {ended}
          {measured && `, ${resultOf(entry)}`}
        </span>
      </div>
      <div class="scan-buttons">
        {can_be_resumed && (
          <Order reason={whyNotStart.value} onClick={() => void order(rig.resumeScan(name))}>
            Resume<span class="unseen"> {name}</span>
          </Order>
        )}
        {frames >= planned && !measured && (
          <Order reason={whyNotStart.value} onClick={() => void order(rig.measure(name))}>
            Measure<span class="unseen"> {name}</span>
          </Order>
        )}
        {measured && (
          <Order reason={whyNot.value} onClick={() => void openResults(name)}>
            Open results<span class="unseen"> of {name}</span>
          </Order>
        )}
      </div>
    </li>
  );
}

/** The sequences of the folder, and what can be done with each. */
export function Sequences({ entries }: { entries: SequenceEntry[] }) {
  if (entries.length === 0) return <p class="hint">There is none yet.</p>;
  return (
    <>
      <Reason words={whyNotStart.value} />
      <ul class="sequences">
        {entries.map((entry) => (
          <Entry key={entry.name} entry={entry} />
        ))}
      </ul>
    </>
  );
}
