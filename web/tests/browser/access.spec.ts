import { test } from '@playwright/test';
import { checkAt, SIZES } from './access';
import { open, showPanel } from './page';

for (const [size, width, height] of SIZES) {
  test(`the results have no faults of access, ${size}`, async ({ page }) => {
    test.slow();
    await page.setViewportSize({ width, height });
    await page.emulateMedia({ colorScheme: 'dark' });
    await open(page, 'results/height?p=452,150&l=300,150,500,150,5');
    const names = await page.getByRole('tab').allTextContents();
    for (const name of names) {
      await test.step(name, async () => {
        await showPanel(page, name);
        await checkAt(page, size, name);
      });
    }
  });
}
