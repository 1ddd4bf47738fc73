import { expect, test } from '@playwright/test';
import { checkAt, SIZES } from './access';
import { FakeRig } from './fake_scan';
import { drawn, quiet } from './quiet';
import { openIn, openProfile, STATES } from './scan_states';

for (const name of Object.keys(STATES)) {
  test(`the scan has no faults of access, ${name}`, async ({ page }) => {
    test.slow();
    await openIn(page, new FakeRig(page), name);
    const folded = page.locator('details:not([open]) > summary');
    while ((await folded.count()) > 0) await folded.first().click();
    await quiet(page);
    for (const [size, width, height] of SIZES) {
      await page.setViewportSize({ width, height });
      await drawn(page);
      await checkAt(page, size, name);
    }
  });
}

for (const [size, width, height] of SIZES) {
  test(`the profile form has no faults of access, ${size}`, async ({ page }) => {
    await page.setViewportSize({ width, height });
    await openProfile(page, new FakeRig(page));
    await expect(page.getByText('loading…')).toHaveCount(0);
    await checkAt(page, size, 'profile');
  });
}
