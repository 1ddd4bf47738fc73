import assert from 'node:assert/strict';
import test from 'node:test';
import { barTicks, wrapped } from '../../src/sheet/sheet';

test('words are wrapped between them', () => {
  const lines = wrapped('aa bbb cccccccc d', 6, (text) => text.length);
  assert.deepEqual(lines, ['aa bbb', 'cccccccc', 'd']);
  assert.deepEqual(
    wrapped('', 6, (text) => text.length),
    [],
  );
});

test('ticks of a colour bar are round and inside', () => {
  const bar = { table: new Uint8Array(4), unit: 'mm' };
  const linear = barTicks({ ...bar, low: -0.23, high: 0.04, scale: 'linear' }, 200);
  assert.deepEqual(
    linear.map(([, text]) => text),
    ['−0.2', '−0.1', '0.0'],
  );
  const log = barTicks({ ...bar, low: 0.0015, high: 0.03, scale: 'log' }, 200);
  assert.deepEqual(
    log.map(([value]) => value),
    [0.002, 0.005, 0.01, 0.02],
  );
});
