import { expect, test } from '@playwright/test';
import { checkAt, SIZES } from './access';
import { FakeRig } from './fake_rig';
import { REAL } from './page';
import { quiet } from './quiet';
import { STATES } from './rig_states';

test.skip(!!REAL, 'the rig is a fake one');

for (const [size, width, height] of SIZES) {
  test(`the rig has no faults of access, ${size}`, async ({ page }) => {
    test.slow();
    await page.setViewportSize({ width, height });
    await page.emulateMedia({ colorScheme: 'dark' });
    const rig = new FakeRig(page);
    // Each picture takes time from the check. So many are enough for a picture that is not old.
    rig.picture_ms = 300;
    const start = rig.state;
    await rig.open();
    // Each fold has its own words to check.
    await expect(page.getByText('More camera controls')).toBeVisible();
    await expect(page.locator('.bar-rate')).toContainText('ms old');
    await page
      .locator('details')
      .evaluateAll((all) => all.forEach((fold) => ((fold as HTMLDetailsElement).open = true)));
    for (const [name, change] of STATES) {
      await test.step(name, async () => {
        rig.tell({ ...start, ...change });
        await rig.shown();
        await quiet(page);
        await checkAt(page, size, name);
      });
    }
    rig.frozen = true;
    await expect(page.locator('.focus')).toHaveClass(/dimmed/);
    await checkAt(page, size, 'stale');
    rig.frozen = false;
    rig.tell({ ...start });
    await rig.shown();
    // What moves and what stops is large enough for gloves.
    for (const name of ['STOP', 'Hold to move left', 'Hold to move right', 'Home (hold)']) {
      const button = page.getByRole('button', { name, exact: true });
      await expect.poll(async () => (await button.boundingBox())!.height).toBeGreaterThanOrEqual(64);
    }
  });
}

test('on narrow screens STOP is alone at the bottom', async ({ page }) => {
  await page.setViewportSize({ width: 390, height: 844 });
  await new FakeRig(page).open();
  // Nothing below it can be scrolled to where it hides. Words that come later make the view longer.
  await expect(async () => {
    const box = (await page.getByRole('button', { name: 'STOP' }).boundingBox())!;
    expect(box.y + box.height).toBeGreaterThan(820);
    await page.locator('.rig').evaluate((view) => view.scrollTo(0, view.scrollHeight));
    const log = (await page.getByRole('region', { name: 'Log' }).boundingBox())!;
    expect(log.y + log.height).toBeLessThanOrEqual(box.y);
  }).toPass();
});
