import { AxeBuilder } from '@axe-core/playwright';
import { expect, test, type Page } from '@playwright/test';
import { SURFACE } from '../mock/replies';
import { open, resultsOf } from './page';

const BYTES = Buffer.from('the bytes of a picture');
const FILE = { name: 'object.png', mimeType: 'image/png', buffer: BYTES };

/** Answers what is asked of the surface, and keeps it. */
async function answers(page: Page, status: number, answer: object): Promise<Record<string, unknown>[]> {
  const asked: Record<string, unknown>[] = [];
  await page.route('**/api/surface', (route) => {
    asked.push(route.request().postDataJSON() as Record<string, unknown>);
    return route.fulfill({ status, json: answer });
  });
  return asked;
}

test('a mask chosen by file is sent, shown, and cleared', async ({ page }) => {
  await open(page, 'results/height?s=steps');
  const { frames } = await resultsOf(page);
  const inside_px = (frames.rows * frames.columns) / 4;
  const field = { answered_px: 9, used_px: 9, mask: { file: 'object.png', inside_px } };
  const asked = await answers(page, 200, { ...SURFACE, field });
  const panel = page.getByRole('tabpanel');
  const input = panel.getByLabel('mask picture');
  await expect(input).toHaveAccessibleDescription(/as large as the frames; what is white is used/);
  await input.setInputFiles(FILE);
  await expect(panel.getByRole('heading', { name: 'Steps and roughness of the mask' })).toBeVisible();
  await expect(input).toHaveAccessibleDescription('25 % of the picture are inside the mask object.png.');
  expect(asked).toEqual([
    {
      region: null,
      mask: { name: 'object.png', base64: BYTES.toString('base64') },
      trend: 'quadric',
      of: expect.any(String),
    },
  ]);
  const { violations } = await new AxeBuilder({ page }).include('[role=tabpanel]').analyze();
  expect(violations).toEqual([]);

  // With the keyboard it goes, and the focus stays where one can go on.
  await panel.getByRole('button', { name: 'Clear mask' }).focus();
  await page.keyboard.press('Enter');
  await expect(panel.getByRole('heading', { name: 'Steps and roughness of the map' })).toBeVisible();
  await expect(input).toBeFocused();
  await expect(input).toHaveValue('');
  // The same file can be chosen again, and nothing was asked in between.
  await input.setInputFiles(FILE);
  await expect(panel.getByRole('button', { name: 'Clear mask' })).toBeVisible();
  await expect(input).toHaveAccessibleDescription('25 % of the picture are inside the mask object.png.');
  expect(asked.length).toBe(2);
});

test('a mask goes with a region', async ({ page }) => {
  const asked = await answers(page, 200, SURFACE);
  await open(page, 'results/height?s=steps&a=100,80,300,200');
  const panel = page.getByRole('tabpanel');
  await panel.getByLabel('mask picture').setInputFiles(FILE);
  await expect(panel.getByRole('heading', { name: 'region and mask' })).toBeVisible();
  await expect.poll(() => asked.at(-1)?.mask).toBeTruthy();
  expect(asked.at(-1)!.region).toEqual([100, 80, 300, 200]);
});

test('a mask that cannot be used is refused in words, and shows no old numbers', async ({ page }) => {
  const message = 'object.png has no pixel above half of full white, so nothing is inside';
  await open(page, 'results/height?s=steps');
  const panel = page.getByRole('tabpanel');
  await expect(panel.locator('.key-number')).toBeVisible();
  await answers(page, 400, { error: { message } });
  await panel.getByLabel('mask picture').setInputFiles(FILE);
  await expect(panel.getByRole('alert')).toHaveText(message);
  await expect(panel.locator('.key-number')).toHaveCount(0);
  await panel.getByRole('button', { name: 'Clear mask' }).click();
  await expect(panel.getByRole('alert')).toHaveCount(0);
  await expect(panel.locator('.key-number')).toBeVisible();
});
