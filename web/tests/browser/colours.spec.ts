import { expect, test } from '@playwright/test';
import { colourTable } from '../../src/colours/tables';
import { heightAt } from '../mock/truth';
import { colourAt, coloursIn } from './colour_at';
import { centre, open, REAL } from './page';

test.skip(!!REAL, 'the truth is that of the mock server');

test('a pixel has the colour of its value', async ({ page }) => {
  await open(page, 'results/height?v=452.5,150.5,32&r=-0.3,0.1');
  await page.getByRole('tab', { name: 'About' }).click();
  const { x, y } = await centre(page);
  const entry = Math.round(((heightAt(452, 150) + 0.3) / 0.4) * 255) * 4;
  const wanted = [...colourTable('viridis').slice(entry, entry + 3)];
  await expect
    .poll(async () => {
      const got = await colourAt(page, x, y);
      return Math.max(...got.map((value, index) => Math.abs(value - wanted[index]!)));
    })
    .toBeLessThanOrEqual(3);
});

test('no data is a checkerboard of two greys', async ({ page }) => {
  await open(page, 'results/height?v=630,240,32');
  await page.getByLabel('mask').uncheck();
  const { x, y } = await centre(page);
  await expect
    .poll(() => coloursIn(page, { x, y: y + 4, width: 16, height: 1 }, 4))
    .toEqual(['58,66,77', '74,83,94']);
});

test('values beyond the range are black and white stripes if one asks for them', async ({ page }) => {
  await open(page, 'results/height?v=452.5,150.5,32&r=0.5,0.6');
  const { x, y } = await centre(page);
  // The colour of the end of the range, as without a range: single pixels beyond it make no snow.
  await expect.poll(() => coloursIn(page, { x, y: y - 6, width: 1, height: 12 })).toEqual(['68,1,84']);
  await page.getByLabel('clipped').check();
  await expect
    .poll(() => coloursIn(page, { x, y: y - 6, width: 1, height: 12 }))
    .toEqual(['0,0,0', '255,255,255']);
});
