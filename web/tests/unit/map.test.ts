import assert from 'node:assert/strict';
import test from 'node:test';
import { bounded, fitted, pixelAt, showing, toScreen, zoomedAt } from '../../src/map/view';
import { coarseWindow, levelFor, windowFor } from '../../src/map/pyramid';
import { roundAbove, roundBelow, ticks, tickText } from '../../src/map/scale_bar';

const canvas = { width: 620, height: 470 };
const image = { width: 1000, height: 700 };

test('the four corners of a zoomed pixel belong to it', () => {
  const view = { x: 512.5, y: 430.5, zoom: 16 };
  const corner = toScreen(view, canvas, 512, 430);
  const inside = 0.01;
  for (const [dx, dy] of [
    [inside, inside],
    [16 - inside, inside],
    [inside, 16 - inside],
    [16 - inside, 16 - inside],
  ] as const) {
    assert.deepEqual(pixelAt(view, canvas, image, corner.x + dx, corner.y + dy), { x: 512, y: 430 });
  }
  assert.deepEqual(pixelAt(view, canvas, image, corner.x - inside, corner.y + inside), {
    x: 511,
    y: 430,
  });
});

test('beside the image there is no pixel', () => {
  const view = fitted(image, canvas);
  assert.equal(pixelAt(view, canvas, image, 1, 1), null);
  assert.deepEqual(pixelAt(view, canvas, image, 0.1, 235), { x: 0, y: 350 });
});

test('zooming keeps the point under the pointer', () => {
  const view = { x: 300, y: 200, zoom: 1.5 };
  const before = pixelAt(view, canvas, image, 100, 300);
  assert.deepEqual(pixelAt(zoomedAt(view, canvas, 2, 100, 300), canvas, image, 100, 300), before);
});

test('the view follows the pin no further than needed', () => {
  const view = { x: 300, y: 200, zoom: 2 };
  assert.deepEqual(showing(view, canvas, { x: 310, y: 210 }), view);
  const moved = showing(view, canvas, { x: 600, y: 210 });
  assert.ok(Math.abs(toScreen(moved, canvas, 600.5, 210.5).x - (canvas.width - 24)) < 1e-9);
  assert.equal(bounded({ x: -50, y: 0, zoom: 1000 }, image, canvas).zoom, 64);
});

test('levels match the zoom', () => {
  assert.equal(levelFor(1, 1, 4), 0);
  assert.equal(levelFor(0.25, 1, 4), 2);
  assert.equal(levelFor(0.25, 2, 4), 1);
  assert.equal(levelFor(0.001, 1, 4), 3);
  assert.equal(levelFor(30, 1, 4), 0);
});

test('a view needs few tiles', () => {
  const large = { width: 5472, height: 3648 };
  for (const zoom of [0.1, 0.14, 0.2, 0.35, 0.5, 0.7, 1, 1.4, 4]) {
    const view = { x: 2000, y: 1800, zoom };
    const window = windowFor(view, canvas, large, levelFor(zoom, 1, 6));
    assert.ok(window.rows * window.columns <= 24, `${zoom}: ${window.rows} x ${window.columns}`);
  }
  const coarse = coarseWindow(large, 6);
  assert.ok(coarse.rows * coarse.columns <= 4);
});

test('windows end at the image', () => {
  assert.deepEqual(windowFor(fitted(image, canvas), canvas, image, 0), {
    level: 0,
    row: 0,
    column: 0,
    rows: 3,
    columns: 4,
  });
});

test('scale bars and ticks are round', () => {
  assert.equal(roundBelow(7.3), 5);
  assert.equal(roundBelow(0.2), 0.2);
  assert.equal(roundAbove(21), 50);
  assert.deepEqual(ticks(-3, 17, 4), [0, 5, 10, 15]);
  assert.equal(tickText(0.5, 0.25), '0.5');
  assert.equal(tickText(-2, 1), '\u22122');
});
