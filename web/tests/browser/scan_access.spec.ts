import { AxeBuilder } from '@axe-core/playwright';
import { expect, test, type Page } from '@playwright/test';
import { FakeRig } from './fake_scan';
import { openProfile, settled, SIZES, STATES } from './scan_states';

async function expectNoFaults(page: Page): Promise<void> {
  const { violations } = await new AxeBuilder({ page })
    .withTags(['wcag2a', 'wcag2aa', 'wcag22aa'])
    .analyze();
  expect(violations.map(({ id, nodes }) => `${id}: ${nodes.map((n) => n.html).join(' ')}`)).toEqual([]);
  const over = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  expect(over).toBeLessThanOrEqual(0);
}

for (const [size, width, height] of SIZES) {
  for (const theme of ['dark', 'light'] as const) {
    test(`no faults of access: scan and profile, ${size}, ${theme}`, async ({ page }) => {
      test.setTimeout(120_000);
      await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: theme });
      for (const [name, set] of Object.entries(STATES)) {
        await test.step(name, async () => {
          await page.goto('about:blank');
          const rig = new FakeRig(page);
          set(rig);
          await rig.open();
          await settled(page);
          const folded = page.locator('details:not([open]) > summary');
          while ((await folded.count()) > 0) await folded.first().click();
          await settled(page);
          await expectNoFaults(page);
        });
      }
      await page.goto('about:blank');
      await openProfile(page, new FakeRig(page));
      await expectNoFaults(page);
    });
  }
}
