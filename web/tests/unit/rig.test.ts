import assert from 'node:assert/strict';
import test from 'node:test';
import { onGrid, sorted } from '../../src/rig/controls';
import { coarser, histogramPath } from '../../src/rig/histogram';
import { readPicture } from '../../src/rig/picture_message';
import { MOST_VALUES, oneToOne, wishFor } from '../../src/rig/picture_view';
import {
  ageText,
  diskText,
  exposureText,
  freshness,
  positionText,
  shareText,
  stepText,
  timeLeftText,
  titleOf,
} from '../../src/rig/texts';
import { fitted, toImage } from '../../src/map/view';
import { viewNamed } from '../../src/store/route';
import { pictureOf } from '../browser/picture';
import type { Control } from '../../src/rig/api';

const frame = { width: 5472, height: 3648 };
const canvas = { width: 620, height: 470 };

test('the whole frame is asked for with no more values than the pane has pixels', () => {
  const wish = wishFor(fitted(frame, canvas), canvas, frame, 1);
  assert.deepEqual([wish.x, wish.y, wish.width, wish.height], [0, 0, 5472, 3648]);
  // 620 px wide, and 413.33 px high.
  assert.ok(Math.abs(wish.pixels - (620 * 620 * 3648) / 5472) <= 1, String(wish.pixels));
  assert.equal(wishFor(fitted(frame, canvas), { width: 2000, height: 1400 }, frame, 2).pixels, MOST_VALUES);
});

test('zoomed in, only the pixels that are seen are asked for, one value each', () => {
  const wish = wishFor({ x: 1000.5, y: 800.5, zoom: 20 }, canvas, frame, 1);
  // 31 px of the frame across: from 985 to 1016; 23.5 px down: from 788.75 to 812.25.
  assert.deepEqual(wish, { x: 985, y: 788, width: 31, height: 25, pixels: 31 * 25, live: true });
});

test('at the edge and beside the frame at least one pixel is asked for', () => {
  const wish = wishFor({ x: 5472, y: 0, zoom: 60 }, canvas, frame, 1);
  assert.equal(wish.x + wish.width, 5472);
  assert.equal(wish.y, 0);
  const beside = wishFor({ x: 9000, y: -500, zoom: 60 }, canvas, frame, 1);
  assert.deepEqual([beside.x, beside.y, beside.width, beside.height], [5471, 0, 1, 1]);
});

test('one to one keeps the point under the finger', () => {
  const view = { x: 300, y: 200, zoom: 0.4 };
  const close = oneToOne(view, canvas, 2, 100, 300);
  assert.equal(close.zoom, 0.5);
  const before = toImage(view, canvas, 100, 300);
  const after = toImage(close, canvas, 100, 300);
  assert.ok(Math.abs(before.x - after.x) < 1e-9 && Math.abs(before.y - after.y) < 1e-9);
});

test('a picture is taken apart, and half a picture is none', () => {
  const bytes = pictureOf({ x: 10, y: 20, width: 7, height: 5, pixels: 35 }, 3);
  const message = Uint8Array.from(bytes).buffer;
  const picture = readPicture(message, 123);
  assert.deepEqual(
    [picture?.head.x, picture?.head.rows, picture?.head.columns, picture?.bytes.length],
    [10, 5, 7, 35],
  );
  assert.equal(readPicture(message.slice(0, message.byteLength - 1), 0), null);
  assert.equal(readPicture(new ArrayBuffer(2), 0), null);
});

test('histograms keep all counts and the whole scale', () => {
  assert.deepEqual(coarser([1, 2, 3, 4, 5], 2), [6, 9]);
  assert.deepEqual(coarser([1, 2], 5), [1, 2]);
  // Two bins of four are told: the right half is empty.
  assert.equal(histogramPath([2, 1], 4, 8, 10, false), 'M0 10V0.0H2.00V5.0H4.00V10.0H6.00V10.0H8.00V10Z');
  // With logarithms a single count among a million still has a height.
  const lone = /V([\d.]+)H8\.00/.exec(histogramPath([1e6, 1], 2, 8, 100, true))![1];
  assert.ok(Number(lone) < 96);
});

test('positions and steps have the digits of the stage', () => {
  assert.equal(positionText(12.3451, [0.01, 0.1, 1]), '12.345 mm');
  assert.equal(positionText(-0.5, [0.001, 1]), '\u22120.5000 mm');
  assert.equal(positionText(3, [1, 10]), '3.00 mm');
  assert.equal(positionText(3, []), '3.000 mm');
  assert.equal(stepText(0.01), '+0.01');
  assert.equal(stepText(-1), '\u22121');
});

test('controls have names that people can read', () => {
  assert.deepEqual(['exposure_time_absolute', 'auto_exposure', 'gain'].map(titleOf), [
    'Exposure',
    'Auto exposure',
    'Gain',
  ]);
});

test('ages, shares, times and disks', () => {
  assert.deepEqual([61.4, 2400, 12_300, 200_000].map(ageText), ['61 ms', '2.4 s', '12 s', '3 min']);
  assert.deepEqual([400, 501, 2001].map(freshness), ['live', 'old', 'stale']);
  assert.equal(shareText(60, 300_000), '0.020 %');
  assert.equal(shareText(0, 300_000), '0 %');
  assert.equal(shareText(1, 20_000_000), '< 0.0001 %');
  assert.equal(shareText(300_000, 300_000), '100 %');
  assert.equal(shareText(299_999, 300_000), '> 99.5 %');
  assert.equal(exposureText(8000), '8.000 ms');
  assert.equal(exposureText(250), '250 µs');
  assert.deepEqual([-40, 4, 52, 119, 240, 9000].map(timeLeftText), [
    'over by 0:40',
    'a few seconds left',
    'about 50 s left',
    'about 120 s left',
    'about 4 min left',
    'about 2.5 h left',
  ]);
  assert.deepEqual([412e9, 3.14e9].map(diskText), ['412 GB', '3.1 GB']);
});

function control(name: string, kind: Control['kind'], minimum = 0, maximum = 10, step = 1): Control {
  return {
    name,
    kind,
    minimum,
    maximum,
    step,
    default: 0,
    value: 0,
    read_only: false,
    inactive: false,
    items: [],
  };
}

test('exposure and gain come first', () => {
  const { first, more } = sorted([
    control('brightness', 'integer'),
    control('auto_exposure', 'menu'),
    control('gain', 'integer'),
    control('exposure_time_absolute', 'integer'),
    control('gain_automatic', 'boolean'),
  ]);
  assert.deepEqual(
    first.map(({ name }) => name),
    ['exposure_time_absolute', 'gain', 'auto_exposure'],
  );
  assert.deepEqual(
    more.map(({ name }) => name),
    ['brightness', 'gain_automatic'],
  );
});

test('values are set on the grid of the control', () => {
  const odd = control('sharpness', 'integer', 1, 10, 4);
  assert.deepEqual(
    [-5, 2, 4, 8, 99].map((value) => onGrid(odd, value)),
    [1, 1, 5, 9, 9],
  );
});

test('the address names a view', () => {
  assert.deepEqual(
    ['#rig', '#scan', '#results/height?p=1,2', '#results', '#rigs', '', '#map'].map(viewNamed),
    ['rig', 'scan', 'results', 'results', null, null, null],
  );
});
