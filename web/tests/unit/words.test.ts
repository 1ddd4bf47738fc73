import assert from 'node:assert/strict';
import { test } from 'node:test';
import { placeBeside } from '../../src/components/beside';
import { decades } from '../../src/format/decades';
import { plainly } from '../../src/format/number';
import { titleOf } from '../../src/format/title';
import { fittedTo } from '../../src/map/view';

test('titles tell pages apart, and what one waits for comes first', () => {
  const scan = { name: 'tile-0042', done: 37, planned: 101, state: 'running' };
  assert.equal(titleOf('scan', null, { rig: 'bench', scan }), '37/101 - tile-0042 - scan - epirig');
  assert.equal(titleOf('rig', null, { rig: 'bench', scan }), '37/101 - tile-0042 - rig - bench - epirig');
  const results = titleOf('results', 'tile-0001', { rig: 'bench', scan });
  assert.equal(results, '37/101 - tile-0042 - tile-0001 - results - epirig');
  const paused = { ...scan, state: 'paused' };
  assert.equal(
    titleOf('scan', null, { rig: 'bench', scan: paused }),
    '37/101 paused - tile-0042 - scan - epirig',
  );
  const done = { ...scan, state: 'done', done: 101 };
  assert.equal(titleOf('scan', null, { rig: 'bench', scan: done }), 'tile-0042 - scan - epirig');
  assert.equal(titleOf('results', 'tile-0042', null), 'tile-0042 - results - epirig');
  assert.equal(titleOf(null, null, null), 'results - epirig');
});

test('words go below what they are about, else above it, and never over what is kept', () => {
  const screen = { width: 390, height: 844 };
  const size = { width: 300, height: 60 };
  const stop = { left: 0, top: 752, right: 390, bottom: 844 };
  const field = (top: number) => ({ left: 350, top, right: 380, bottom: top + 32 });
  assert.deepEqual(placeBeside(field(100), size, screen, [stop]), { left: 84, top: 138 });
  assert.deepEqual(placeBeside(field(700), size, screen, [stop]), { left: 84, top: 634 });
  const bar = { left: 0, top: 0, right: 390, bottom: 96 };
  const low = { width: 390, height: 200 };
  assert.equal(placeBeside(field(100), size, low, [bar, { ...stop, top: 130, bottom: 200 }]), null);
});

test('a logarithmic axis has 1, 2 and 5 of each decade', () => {
  assert.deepEqual(decades(0.015, 0.6), [0.02, 0.05, 0.1, 0.2, 0.5]);
  assert.deepEqual(decades(3, 4), []);
});

test('values without sigma have the digits that they have', () => {
  assert.equal(plainly(116), '116');
  assert.equal(plainly(0.97653), '0.9765');
  assert.equal(plainly(-0.0065384), '\u22120.006538');
});

test('the view begins with the part that has answers, unless that is nearly all', () => {
  const [image, canvas] = [
    { width: 1000, height: 1000 },
    { width: 540, height: 540 },
  ];
  assert.deepEqual(fittedTo([400, 300, 600, 500], image, canvas), { x: 500, y: 400, zoom: 2.5 });
  const all = { x: 500, y: 500, zoom: 0.54 };
  assert.deepEqual(fittedTo([5, 5, 990, 980], image, canvas), all);
  assert.deepEqual(fittedTo(null, image, canvas), all);
});
