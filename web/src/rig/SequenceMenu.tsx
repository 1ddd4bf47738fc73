import { useEffect } from 'preact/hooks';
import { about } from '../store/results';
import { loadSequences, openSequence, sequences } from './sequences';
import { onlyWatches } from './store';

/** All sequences as a menu in the bar, to go from one to another. */
export function SequenceMenu() {
  const shown = about.value?.sequence ?? null;
  useEffect(() => void loadSequences(), [shown]);
  if (onlyWatches.value) return <span class="sequence">{shown}</span>;
  const list = (sequences.value ?? []).filter(({ state }) => state !== 'unreadable');
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
