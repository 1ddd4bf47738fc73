// Pictures of the scan view and the profile form, for people to look at: `npm run look`.

import { test } from '@playwright/test';
import { FakeRig } from './fake_scan';
import { openProfile, settled, SIZES, STATES } from './scan_states';

test.skip(!process.env.LOOK, 'set LOOK=1 to take pictures');

for (const [size, width, height] of SIZES) {
  for (const theme of ['dark', 'light'] as const) {
    test(`look at the scan, ${size}, ${theme}`, async ({ page }) => {
      test.setTimeout(120_000);
      await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: theme });
      for (const [name, set] of Object.entries(STATES)) {
        await page.goto('about:blank');
        const rig = new FakeRig(page);
        set(rig);
        await rig.open();
        await settled(page);
        await page.screenshot({ path: `screenshots/${size}-${theme}-scan-${name}.png` });
      }
      await page.goto('about:blank');
      await openProfile(page, new FakeRig(page));
      await page.screenshot({ path: `screenshots/${size}-${theme}-profile.png` });
    });
  }
}
