import assert from 'node:assert/strict';
import test from 'node:test';
import { between, moved, pointAt, within } from '../../src/panels/between';

const point = (distance_mm: number, height_mm: number | null, sigma_mm: number | null = 0.003) => ({
  x_px: 0,
  y_px: 0,
  distance_mm,
  height_mm,
  sigma_mm,
});

test('a step between two cursors has its distance, its sigma and its slope', () => {
  const found = between(point(1, 0.1, 0.003), point(3, -0.1, 0.004))!;
  assert.equal(found.dx_mm, 2);
  assert.ok(Math.abs(found.dz_mm + 0.2) < 1e-12);
  assert.ok(Math.abs(found.sigma_mm! - 0.005) < 1e-12);
  // tan(5.7106 deg) = 0.1.
  assert.ok(Math.abs(found.slope_deg! + 5.7106) < 1e-4);
  assert.equal(between(point(1, null), point(2, 0)), null);
  assert.equal(between(point(1, 0, null), point(2, 0))!.sigma_mm, null);
  assert.equal(between(point(1, 0), point(1, 1))!.slope_deg, null);
});

test('the nearer cursor is moved, and both stay on the line', () => {
  assert.deepEqual(moved([1, 5], 2), [2, 5]);
  assert.deepEqual(moved([1, 5], 4), [1, 4]);
  assert.deepEqual(within([1, 5], [0, 2, 4]), [1, 4]);
  const points = [0, 0.5, 1].map((at) => point(at, 0));
  assert.deepEqual([pointAt(points, 0.6), pointAt(points, 9), pointAt(points, -1)], [1, 2, 0]);
});
