import assert from 'node:assert/strict';
import test from 'node:test';
import { fromHash, NOTHING, toHash, type Pin, type Selection } from '../../src/store/hash';
import { splitToken } from '../../src/store/token';

const full: Selection = {
  map: 'height-sigma',
  pin: { x: 512, y: 430 },
  line: { x0: 100, y0: 430, x1: 900, y1: 430, width: 5 },
  kept: [{ x0: 1, y0: 2, x1: 30, y1: 40, width: 9 }],
  region: [10, 20, 300, 400],
  level: { region: [11, 21, 31, 41] },
  view: { x: 512.5, y: 430.25, zoom: 2 },
  colours: 'cividis',
  range: { mode: 'hand', low: -0.3, high: 1.2 },
  frame: 37,
  kind: 'rectified',
  compare: 'look & see',
  compareSequence: 'monday/tile 7',
  panel: 'pixel',
  solid: true,
};

test('a selection survives the address', () => {
  assert.deepEqual(fromHash(toHash(full)), full);
  const level = {
    points: [
      { x: 1, y: 2 },
      { x: 3, y: 4 },
      { x: 5, y: 6 },
    ] as [Pin, Pin, Pin],
  };
  assert.deepEqual(fromHash(toHash({ ...full, level })), { ...full, level });
  assert.deepEqual(fromHash(toHash({ ...NOTHING, map: 'height' })), { ...NOTHING, map: 'height' });
});

test('addresses are short', () => {
  assert.ok(toHash(full).length < 300);
});

test('nonsense in an address is left out', () => {
  const read = fromHash('#results/height?p=1,x&l=1,2&v=1,2,-3&r=5,2&f=&m=jet&lv=points-1-2-3&ls=1,2;3');
  assert.deepEqual(read, { ...NOTHING, map: 'height' });
  assert.deepEqual(fromHash('#elsewhere'), NOTHING);
});

test('the token leaves the address and the rest stays', () => {
  assert.deepEqual(splitToken('#token=abc'), { token: 'abc', rest: '' });
  assert.deepEqual(splitToken('#results/height?p=1,2&token=abc'), {
    token: 'abc',
    rest: '#results/height?p=1,2',
  });
  assert.deepEqual(splitToken('#results/height?token=abc&p=1,2'), {
    token: 'abc',
    rest: '#results/height?p=1,2',
  });
  assert.deepEqual(splitToken('#results/height'), { token: null, rest: '#results/height' });
});
