// Pictures of every panel at three sizes in both themes, for people to look at: `npm run look`.

import { test } from '@playwright/test';
import type { Results } from '../../src/api';
import { SIZES } from './access';
import { foundPixel, open, resultsOf } from './page';

test.skip(!process.env.LOOK, 'set LOOK=1 to take pictures');

/** Every map, a frame, a difference and a region. */
function statesOf(results: Results, line: number[]): [name: string, hash: string][] {
  const [x0, y0, x1] = line;
  const region = `a=${x0},${y0},${x1},${Math.round(results.frames.rows * 0.8)}`;
  const first = results.maps[0]!.id;
  return [
    ...results.maps.map(({ id }): [string, string] => [id, `results/${id}`]),
    ['frame', `results/${first}?f=3&s=frames`],
    ['region', `results/${first}?${region}&s=region`],
    ['steps', `results/${first}?${region}&s=steps`],
    [
      'levelled',
      `results/height?lv=${region.replace('a=', 'region-').replaceAll(',', '-')}&l=${line.join(',')},5&s=region&${region}`,
    ],
    ['solid', `results/height?d=3`],
    ['lines', `results/height?l=${line.join(',')},5&ls=${x0},${y0! + 40},${x1},${y0},5`],
    ...results.others.slice(0, 1).map((other): [string, string] => {
      return ['difference', `results/difference?cmp=${other}&s=compare`];
    }),
  ];
}

for (const [size, width, height] of SIZES) {
  for (const theme of ['dark', 'light'] as const) {
    test(`look at ${size}, ${theme}`, async ({ page }) => {
      await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: theme });
      await open(page);
      const at = await foundPixel(page);
      const results = await resultsOf(page);
      const { frames, maps } = results;
      const line = [0.2, 0.35, 0.85, 0.35].map((share, index) =>
        Math.round(share * (index % 2 ? frames.rows : frames.columns)),
      );
      await open(page, `results/${maps[0]!.id}?p=${at.x},${at.y}&l=${line.join(',')},5`);
      const names = await page.getByRole('tab').allTextContents();
      for (const name of names) {
        await page.getByRole('tab', { name }).click();
        await page.waitForTimeout(700);
        const path = `screenshots/${size}-${theme}-${name.toLowerCase().replace(' ', '-')}.png`;
        await page.screenshot({ path });
      }
      await page.evaluate(() => document.querySelector('.results')?.scrollTo(0, 0));
      for (const [name, hash] of statesOf(results, line)) {
        await open(page, hash);
        await page.waitForTimeout(name === 'solid' ? 3000 : 1200);
        await page.screenshot({ path: `screenshots/${size}-${theme}-map-${name}.png` });
      }
    });
  }
}
