// Pictures of the scan view and the profile form, for people to look at: `npm run look`.

import { test } from '@playwright/test';
import { SIZES } from './access';
import { FakeRig } from './fake_scan';
import { openIn, openProfile, STATES } from './scan_states';

test.skip(!process.env.LOOK, 'set LOOK=1 to take pictures');

for (const [size, width, height] of SIZES) {
  for (const theme of ['dark', 'light'] as const) {
    test(`look at the scan, ${size}, ${theme}`, async ({ page }) => {
      await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: theme });
      for (const name of Object.keys(STATES)) {
        await page.goto('about:blank');
        await openIn(page, new FakeRig(page), name);
        await page.screenshot({ path: `screenshots/${size}-${theme}-scan-${name}.png` });
      }
      await page.goto('about:blank');
      await openProfile(page, new FakeRig(page));
      await page.screenshot({ path: `screenshots/${size}-${theme}-profile.png` });
    });
  }
}
