import { AxeBuilder } from '@axe-core/playwright';
import { expect, test, type Page } from '@playwright/test';
import { FakeRig } from './fake_rig';
import { REAL } from './page';
import { STATES } from './rig_states';

test.skip(!!REAL, 'the rig is a fake one');

const SIZES = [
  [1280, 720],
  [820, 1180],
  [390, 844],
] as const;

async function faultsOf(page: Page, name: string): Promise<string[]> {
  const { violations } = await new AxeBuilder({ page })
    .withTags(['wcag2a', 'wcag2aa', 'wcag22aa'])
    .analyze();
  return violations.map(({ id, nodes }) => `${name}: ${id}: ${nodes.map((n) => n.html).join(' ')}`);
}

for (const [width, height] of SIZES) {
  for (const theme of ['dark', 'light'] as const) {
    test(`the rig has no faults of access at ${width} x ${height}, ${theme}`, async ({ page }) => {
      test.slow();
      await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: theme });
      const rig = new FakeRig(page);
      const start = rig.state;
      await rig.open();
      // Each fold has its own words to check.
      await expect(page.getByText('More camera controls')).toBeVisible();
      await page
        .locator('details')
        .evaluateAll((all) => all.forEach((fold) => ((fold as HTMLDetailsElement).open = true)));
      for (const [name, change] of STATES) {
        rig.tell({ ...start, ...change });
        await page.waitForTimeout(200);
        expect(await faultsOf(page, name)).toEqual([]);
      }
      rig.frozen = true;
      await expect(page.locator('.focus')).toHaveClass(/dimmed/);
      expect(await faultsOf(page, 'stale')).toEqual([]);
      rig.frozen = false;
      rig.tell({ ...start });
      // Nothing is wider than the screen.
      const over = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      expect(over).toBeLessThanOrEqual(0);
      // What moves and what stops is large enough for gloves.
      for (const name of ['STOP', 'Hold to move left', 'Hold to move right', 'Home (hold)']) {
        const box = await page.getByRole('button', { name, exact: true }).boundingBox();
        expect(box!.height).toBeGreaterThanOrEqual(64);
      }
    });
  }
}

test('on narrow screens STOP is alone at the bottom', async ({ page }) => {
  await page.setViewportSize({ width: 390, height: 844 });
  await new FakeRig(page).open();
  const box = (await page.getByRole('button', { name: 'STOP' }).boundingBox())!;
  expect(box.y + box.height).toBeGreaterThan(820);
  // Nothing below it can be scrolled to where it hides. Words that come later make the view longer.
  await expect(async () => {
    await page.locator('.rig').evaluate((view) => view.scrollTo(0, view.scrollHeight));
    const log = (await page.getByRole('region', { name: 'Log' }).boundingBox())!;
    expect(log.y + log.height).toBeLessThanOrEqual(box.y);
  }).toPass();
});
