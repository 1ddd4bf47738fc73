import assert from 'node:assert/strict';
import { test } from 'node:test';
import { changeText, layoutOf, rangeOf, valueText } from '../../src/sequences/chart';
import { filtered, onScreen, sorted } from '../../src/sequences/rows';
import type { SequenceEntry, SeriesChart } from '../../src/types';
import { sequenceList, trendOf } from '../mock/sequences';

const LIST = sequenceList(60);

function entry(name: string, change: Partial<SequenceEntry>): SequenceEntry {
  return { ...LIST[0]!, name, problem: null, ...change };
}

test('rows are sorted by any column, and equal ones the newest first', () => {
  const list = [
    entry('tile-10', { created: '2026-01-02', depth_mm: null, verdict: null, state: 'scan' }),
    entry('tile-9', { created: '2026-01-01', depth_mm: 0.3, verdict: 'fail', state: 'measured' }),
    entry('tile-8', { created: '2026-01-03', depth_mm: 0.2, verdict: 'pass', state: 'measured' }),
  ];
  const by = (column: Parameters<typeof sorted>[1]['column'], descending = false): string =>
    sorted(list, { column, descending })
      .map(({ name }) => name.slice(5))
      .join(' ');
  assert.equal(by('name'), '8 9 10');
  assert.equal(by('created'), '9 10 8');
  assert.equal(by('created', true), '8 10 9');
  assert.equal(by('depth'), '10 8 9');
  assert.equal(by('state', true), '8 9 10');
  assert.equal(by('verdict', true), '9 8 10');
});

test('each word of the filter must be told of a row', () => {
  const count = (text: string): number => filtered(LIST, text).length;
  assert.equal(count(''), 60);
  assert.equal(count('  FAIL '), 1);
  assert.equal(count('monday'), 30);
  assert.equal(
    count('monday 2026-09-01 pass'),
    filtered(filtered(LIST, 'monday'), '2026-09-01 pass').length,
  );
  assert.equal(count('nowhere'), 0);
});

test('of a thousand rows those on the screen are drawn', () => {
  const [first, after] = onScreen(1000, 50, 20_000, 500);
  assert.ok(first <= 400 && after >= 410 && after - first < 30, `${first} ${after}`);
  assert.deepEqual(onScreen(3, 50, 0, 500), [0, 3]);
  assert.deepEqual(onScreen(3, 50, 9000, 500), [3, 3]);
  assert.deepEqual(onScreen(0, 50, 0, 500), [0, 0]);
});

const chart: SeriesChart = trendOf(
  { measure: 'depth', sequences: LIST.map(({ name }) => name) },
  LIST,
).chart!;

test('a chart shows its values and limits, and wide tolerances only as far as there is room', () => {
  const [low, high] = rangeOf(chart);
  const values = chart.points.map(({ value }) => value);
  assert.ok(low < Math.min(...values, chart.lower) && high > Math.max(...values, chart.upper));
  const far = { ...chart, lower_limit: -5, upper_limit: 5 };
  assert.deepEqual(rangeOf(far), rangeOf({ ...chart, lower_limit: null, upper_limit: null }));
  const equal = { ...chart, lower: 1, upper: 1, mean: 1, lower_limit: null, upper_limit: null };
  const [least, most] = rangeOf({ ...equal, points: [{ ...chart.points[0]!, value: 1, sigma: null }] });
  assert.ok(least < 1 && most > 1);
});

test('places in a chart lead back to their values', () => {
  const { x, nearest, rows, columns, y } = layoutOf(chart, 460, 260);
  chart.points.forEach((_, index) => assert.equal(nearest(x(index)), index));
  assert.equal(nearest(-100), 0);
  assert.equal(nearest(9999), chart.points.length - 1);
  assert.ok(y(chart.upper) < y(chart.lower));
  assert.ok(rows.length >= 3 && columns.length >= 3);
  for (const ticks of [rows, columns])
    assert.equal(new Set(ticks.map(({ text }) => text)).size, ticks.length);
});

test('a change of the mean is told with its place', () => {
  assert.match(
    changeText(chart)!,
    /^The mean has changed by \+0\.000\d+ mm at friday\/tile-00\d\d \(between /,
  );
  assert.equal(changeText({ ...chart, change: null }), null);
  assert.equal(valueText({ ...chart, unit: 'um', scatter: 0.12 }, -1.5), '\u22121.50 µm');
});
