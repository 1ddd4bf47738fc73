import assert from 'node:assert/strict';
import test from 'node:test';
import type { LineInfo } from '../../src/api';
import { profilesOf } from '../../src/panels/profiles';

const info = (distances: number[], heights: (number | null)[]): LineInfo => ({
  unit: 'mm',
  points: distances.map((distance_mm, index) => ({
    x_px: index,
    y_px: 0,
    distance_mm,
    height_mm: heights[index]!,
    sigma_mm: heights[index] === null ? null : 0.5,
  })),
});

test('profiles with other distances share one axis, and each keeps its gaps', () => {
  const last = info([0, 1, 2], [5, null, 7]);
  const kept = info([0, 1.5, 3], [1, 2, null]);
  const { x, curves, own, points } = profilesOf(last, [kept], ['A–B', 'C–D'], 10);
  assert.deepEqual(x, [0, 1, 1.5, 2, 3]);
  assert.deepEqual(own, [0, 1, 3]);
  assert.equal(points, last.points);
  const of = (label: string) => curves.find((curve) => curve.label === label)!.values;
  assert.deepEqual(of('C–D'), [50, null, undefined, 70, undefined]);
  assert.deepEqual(of('A–B'), [10, undefined, 20, undefined, null]);
  assert.deepEqual(of('value + sigma'), [55, null, undefined, 75, undefined]);
});

test('distances that differ by rounding alone are one', () => {
  const { x, own } = profilesOf(info([0, 0.1 + 0.2], [1, 2]), [info([0, 0.3], [3, 4])], ['A–B', 'C–D'], 1);
  assert.equal(x.length, 2);
  assert.deepEqual(own, [0, 1]);
});
