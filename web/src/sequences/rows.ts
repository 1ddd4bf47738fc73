// The rows of the table: which of the sequences, in which order, and where they are on the screen.

import { moment } from '../format/moment';
import type { SequenceEntry } from '../types';

export type Column = 'name' | 'created' | 'state' | 'depth' | 'verdict';

export interface Order {
  column: Column;
  descending: boolean;
}

const STATES: SequenceEntry['state'][] = ['unreadable', 'scan', 'calibrated', 'matched', 'measured'];
const VERDICTS: SequenceEntry['verdict'][] = [null, 'pass', 'undecided', 'fail'];

/** What a column is sorted by. */
const KEYS: Record<Column, (entry: SequenceEntry) => string | number> = {
  name: ({ name }) => name,
  created: ({ created }) => created,
  state: ({ state }) => STATES.indexOf(state),
  // Those without a depth come before the shallowest.
  depth: ({ depth_mm }) => depth_mm ?? -Infinity,
  verdict: ({ verdict }) => VERDICTS.indexOf(verdict),
};

// A number inside of a name counts as a number: tile-9 is before tile-10. One comparer serves a thousand names.
const names = new Intl.Collator('en', { numeric: true });

function compared(one: string | number, other: string | number): number {
  if (typeof one === 'number' && typeof other === 'number') return one < other ? -1 : Number(one > other);
  return names.compare(String(one), String(other));
}

/** The entries in an order; those that are equal, the newest first. */
export function sorted(entries: readonly SequenceEntry[], { column, descending }: Order): SequenceEntry[] {
  const key = KEYS[column];
  const sign = descending ? -1 : 1;
  return [...entries].sort(
    (one, other) =>
      sign * compared(key(one), key(other)) ||
      compared(other.created, one.created) ||
      compared(one.name, other.name),
  );
}

/** The entries that have each word of a text: in their name, day, state or verdict. */
export function filtered(entries: readonly SequenceEntry[], text: string): SequenceEntry[] {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  return entries.filter(({ name, created, state, verdict }) => {
    const told = `${name} ${moment(created)} ${state} ${verdict ?? ''}`.toLowerCase();
    return words.every((word) => told.includes(word));
  });
}

/** Rows beyond the edge of the screen that are drawn: as far as one goes with Tab before the table is scrolled. */
const BEYOND = 6;

/** Which rows to draw of so many: the first, and the one after the last. */
export function onScreen(
  count: number,
  row_px: number,
  top_px: number,
  height_px: number,
): [first: number, after: number] {
  const first = Math.floor(top_px / row_px) - BEYOND;
  const after = Math.ceil((top_px + height_px) / row_px) + BEYOND;
  const within = (row: number): number => Math.min(Math.max(row, 0), count);
  return [within(first), within(after)];
}
