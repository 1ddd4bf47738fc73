// Pictures of the rig in its states, for people to look at: `npm run look`.

import { test } from '@playwright/test';
import { SIZES } from './access';
import { FakeRig } from './fake_rig';
import { REAL } from './page';
import { openIn, STATES } from './rig_states';

test.skip(!process.env.LOOK || !!REAL, 'set LOOK=1 to take pictures of the fake rig');

for (const [size, width, height] of SIZES) {
  for (const theme of ['dark', 'light'] as const) {
    test(`look at the rig, ${size}, ${theme}`, async ({ page }) => {
      test.slow();
      await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: theme });
      const rig = await openIn(page, {});
      const start = rig.state;
      const take = (name: string) =>
        page.screenshot({ path: `screenshots/rig-${size}-${theme}-${name}.png` });
      for (const [name, change] of STATES) {
        rig.tell({ ...start, ...change });
        await page.waitForTimeout(300);
        await take(name);
      }
      rig.tell({ ...start, ...STATES[0]![1] });
      for (const key of ['g', 'v', 'f']) await page.keyboard.press(key);
      const scroller = page.locator(size === 'wide' ? '.rig-column' : '.rig');
      for (const part of [1, 2]) {
        await scroller.evaluate((view, share) => view.scrollTo(0, view.scrollHeight * share), part / 2);
        await page.waitForTimeout(200);
        await take(`ready-${part}`);
      }
      await scroller.evaluate((view) => view.scrollTo(0, 0));
      rig.frozen = true;
      await page.waitForTimeout(2600);
      await take('stale');
      await rig.vanish();
      await page.waitForTimeout(1500);
      await take('gone');
    });

    test(`look at watching and lists, ${size}, ${theme}`, async ({ page }) => {
      await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: theme });
      const watching = new FakeRig(page, { token: false, sequence: null });
      await watching.open();
      await page.waitForTimeout(500);
      await page.screenshot({ path: `screenshots/rig-${size}-${theme}-watching.png` });
      await page.keyboard.press('3');
      await page.waitForTimeout(500);
      await page.screenshot({ path: `screenshots/rig-${size}-${theme}-sequences.png` });
      await page.keyboard.press('?');
      await page.waitForTimeout(300);
      await page.screenshot({ path: `screenshots/rig-${size}-${theme}-keys.png` });
    });
  }
}
