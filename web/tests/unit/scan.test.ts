import assert from 'node:assert/strict';
import test from 'node:test';
import { clipped, fresh, heldBy } from '../../src/scan/held_range';
import { diskVerdict, duration, holders, positionError, sigmaPair, timeLeft } from '../../src/scan/words';

test('time left has 10 s steps under 2 min, then minutes', () => {
  assert.equal(timeLeft(243), 'about 4 min left');
  assert.equal(timeLeft(113), 'about 110 s left');
  assert.equal(timeLeft(116), 'about 2 min left');
  assert.equal(timeLeft(51), 'about 50 s left');
  assert.equal(timeLeft(2), 'about 10 s left');
  assert.equal(timeLeft(0), 'about 10 s left');
  assert.equal(timeLeft(4800), 'about 1 h 20 min left');
  assert.equal(timeLeft(7190), 'about 2 h left');
});

test('no step of rounding is read as less than the step before', () => {
  assert.equal(duration(114.9), 'about 110 s');
  assert.equal(duration(115), 'about 2 min');
  assert.equal(duration(3569), 'about 59 min');
  assert.equal(duration(3570), 'about 1 h');
});

test('what is over the estimate is counted up', () => {
  assert.equal(timeLeft(-40), 'over by 0:40');
  assert.equal(timeLeft(-0.3), 'over by 0:01');
  assert.equal(timeLeft(-125), 'over by 2:05');
  assert.equal(timeLeft(null), 'time left not known yet');
});

test('the range grows, is taken anew if little fills it, and tells by which stop', () => {
  const first = heldBy(null, { low: 2, high: 5, frames: 12 });
  assert.deepEqual(first, { low: 2, high: 5, frames: 12 });
  const inside = heldBy(first, { low: 3, high: 4.5, frames: 18 });
  assert.equal(inside, first);
  const higher = heldBy(inside, { low: 3, high: 6, frames: 24 });
  assert.deepEqual(higher, { low: 2, high: 6, frames: 24 });
  assert.deepEqual(heldBy(higher, { low: 1, high: 4, frames: 30 }), { low: 1, high: 6, frames: 30 });
  assert.deepEqual(heldBy(higher, { low: 3, high: 4, frames: 31 }), { low: 3, high: 4, frames: 31 });
  assert.deepEqual(fresh({ low: 3, high: 4, frames: 31 }), { low: 3, high: 4, frames: 31 });
});

test('a range is never empty, and no answer at all changes nothing', () => {
  const flat = heldBy(null, { low: 2, high: 2, frames: 3 });
  assert.ok(flat.high > flat.low);
  assert.equal(heldBy(flat, { low: NaN, high: NaN, frames: 4 }), flat);
});

test('shares beyond the range leave out what has no answer', () => {
  const values = new Float32Array([1, 2, 3, NaN, 4, 5]);
  assert.deepEqual(clipped(values, 2, 4), { under: 0.2, over: 0.2 });
  assert.deepEqual(clipped(new Float32Array([NaN]), 0, 1), { under: 0, over: 0 });
});

test('two sigmas have the same places, and the smaller has two digits', () => {
  assert.deepEqual(sigmaPair(0.0091, 0.024), ['0.0091', '0.0240']);
  assert.deepEqual(sigmaPair(0.0996, 0.24), ['0.10', '0.24']);
});

test('position errors are in um with a sign', () => {
  assert.equal(positionError(17.9996, 18), '\u22120.4 µm');
  assert.equal(positionError(18.0021, 18), '+2.1 µm');
  assert.equal(positionError(18.00001, 18), '0.0 µm');
});

test('the disk is amber below 1.5 times the need and red below it', () => {
  assert.equal(diskVerdict(2, 3), 'good');
  assert.equal(diskVerdict(2, 2.9), 'warning');
  assert.equal(diskVerdict(2, 1.9), 'bad');
  assert.equal(diskVerdict(null, 1), 'unknown');
});

test('holders are named', () => {
  assert.equal(holders(['operator']), 'the operator');
  assert.equal(holders(['operator', 'disk']), 'the operator and the disk');
  assert.equal(holders(['operator', 'stage', 'doctor']), 'the operator, the stage and doctor');
});
