import { AxeBuilder } from '@axe-core/playwright';
import { expect, test } from '@playwright/test';
import { open } from './page';

const SIZES = [
  [1280, 720],
  [820, 1180],
  [390, 844],
] as const;

for (const [width, height] of SIZES) {
  for (const theme of ['dark', 'light'] as const) {
    test(`no faults of access at ${width} x ${height}, ${theme}`, async ({ page }) => {
      await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: theme });
      await open(page);
      const names = await page.getByRole('tab').allTextContents();
      for (const name of names) {
        await page.getByRole('tab', { name }).click();
        await page.waitForTimeout(200);
        const { violations } = await new AxeBuilder({ page })
          .withTags(['wcag2a', 'wcag2aa', 'wcag22aa'])
          .analyze();
        const found = violations.map(
          ({ id, nodes }) => `${name}: ${id}: ${nodes.map((n) => n.html).join(' ')}`,
        );
        expect(found).toEqual([]);
      }
      // Nothing is wider than the screen.
      const over = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
      expect(over).toBeLessThanOrEqual(0);
    });
  }
}
