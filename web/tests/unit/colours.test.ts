import assert from 'node:assert/strict';
import test from 'node:test';
import { colourTable } from '../../src/colours/tables';
import { histogramOf, positionOf, sharesBeyond, valueAt } from '../../src/colours/range';

const at = (name: 'viridis' | 'cividis' | 'magma' | 'vik' | 'grey', entry: number): number[] => [
  ...colourTable(name).slice(entry * 4, entry * 4 + 3),
];
const near = (one: number[], other: number[]): void =>
  one.forEach((value, index) =>
    assert.ok(Math.abs(value - (other[index] ?? 0)) <= 3, `${one} against ${other}`),
  );

// Values of matplotlib and of Crameri's package.
test('colour tables agree with those published', () => {
  near(at('viridis', 0), [0x44, 0x01, 0x54]);
  near(at('viridis', 128), [0x21, 0x91, 0x8c]);
  near(at('viridis', 255), [0xfd, 0xe7, 0x25]);
  near(at('magma', 64), [0x51, 0x12, 0x7c]);
  near(at('cividis', 128), [0x7d, 0x7c, 0x78]);
  near(at('vik', 64), [0x30, 0x7d, 0xa6]);
  near(at('grey', 128), [128, 128, 128]);
});

test('luminance of ordered tables rises', () => {
  for (const name of ['viridis', 'cividis', 'magma', 'grey'] as const) {
    let before = -1;
    for (let entry = 0; entry < 256; entry += 8) {
      const [red = 0, green = 0, blue = 0] = at(name, entry);
      const luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
      assert.ok(luminance >= before - 0.5, `${name} at ${entry}`);
      before = luminance;
    }
  }
});

test('positions and values of both scales are inverse', () => {
  for (const scale of ['linear', 'log'] as const) {
    assert.ok(Math.abs(positionOf(valueAt(0.3, 0.001, 0.1, scale), 0.001, 0.1, scale) - 0.3) < 1e-12);
  }
});

test('shares beyond the ends follow the histogram', () => {
  const counts = new Array<number>(256).fill(4);
  const shares = sharesBeyond({ low: 0, high: 1, counts }, 0.1, 0.75);
  assert.ok(Math.abs(shares.under - 0.1) < 1e-9);
  assert.ok(Math.abs(shares.over - 0.25) < 1e-9);
});

test('values beyond a histogram are in its end bins', () => {
  const { counts } = histogramOf([-9, 0.5, 9, NaN], 0, 1);
  assert.deepEqual([counts[0], counts[128], counts[255]], [1, 1, 1]);
});
