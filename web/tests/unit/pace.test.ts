import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Pace } from '../../src/map/pace';

function shares(moving: boolean, gaps_ms: readonly number[]): number[] {
  const pace = new Pace();
  let now = 0;
  return gaps_ms.map((gap) => pace.share(moving, (now += gap)));
}

test('a computer that keeps up draws all pixels', () => {
  assert.deepEqual(shares(true, [17, 17, 17, 17, 17]), [1, 1, 1, 1, 1]);
  // One late picture, or a pause of the hand, says nothing.
  assert.deepEqual(shares(true, [17, 60, 17, 60, 900, 17]), [1, 1, 1, 1, 1, 1]);
});

test('a slow one draws fewer while a handle moves, and all of them afterwards', () => {
  const pace = new Pace();
  const during = [0, 60, 120, 180, 190].map((now) => pace.share(true, now));
  assert.deepEqual(during.slice(0, 3), [1, 1, 1]);
  assert.ok(during[3]! < 1 && during[4] === during[3]);
  assert.equal(pace.share(false, 200), 1);
  assert.deepEqual(shares(false, [60, 60, 60, 60, 60]), [1, 1, 1, 1, 1]);
});
