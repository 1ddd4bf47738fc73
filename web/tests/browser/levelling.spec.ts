import { expect, test, type Page } from '@playwright/test';
import { readFile } from 'node:fs/promises';
import { measured, significant, toPlaces } from '../../src/format/number';
import { levelledAt, planeBy, regionInNumbers } from '../mock/levelling';
import { heightAt, sigmaMmAt } from '../mock/truth';
import { mapOf, open, REAL, resultsOf, showPanel, valueOf } from './page';
import { expectNoFaults } from './access';
import { quiet } from './quiet';

test.beforeEach(() => test.skip(!!REAL, 'the truth is that of the mock server'));

const note = (page: Page) => page.locator('.level-note');
const mrad = (value: number): string => `${significant(value, 3)} mrad`;

test('a region of one level is told in numbers, as the truth has them', async ({ page }) => {
  await open(page, 'results/height?a=60,250,360,370&s=region');
  const panel = page.getByRole('tabpanel', { name: 'Region' });
  const truth = regionInNumbers([60, 250, 360, 370], null)!;
  await expect(panel).toContainText('About the least-squares plane of the region (ISO 25178-2)');
  for (const [name, text] of [
    ['mean height', measured(truth.mean_mm, truth.mean_sigma_mm, 'mm')],
    ['tilt along x', measured(truth.tilt_x_mrad, 0.02, 'mrad')],
    ['tilt along y', `${toPlaces(truth.tilt_y_mrad, 3)} mrad, sigma unknown`],
    ['Sa', `${truth.roughness.sa_mm.toFixed(4)} mm`],
    ['Sq', `${truth.roughness.sq_mm.toFixed(4)} mm`],
    ['Sz', `${truth.roughness.sz_mm.toFixed(4)} mm`],
    ['pixels answered', '36\u2009000 of 36\u2009000'],
  ] as const) {
    await expect(panel.getByRole('row').filter({ hasText: name })).toContainText(text);
  }
});

test('a region without a plane says so', async ({ page }) => {
  await open(page, 'results/height?a=618,10,630,20&s=region');
  await expect(page.getByRole('alert')).toContainText('The pixels of the region determine no plane.');
});

test('three points level the map, its values and its profile, and there is a way back', async ({
  page,
}) => {
  await open(page, 'results/height?p=100,300&l=100,300,300,300,5&s=region');
  await page.getByRole('button', { name: 'Level by three points' }).click();
  // Without a mouse: the map has the focus, the pin goes there, Enter takes it.
  await expect(mapOf(page)).toBeFocused();
  await page.keyboard.press('Enter');
  await expect(note(page)).toContainText('point 2 of 3');
  for (let by = 0; by < 5; by += 1) await page.keyboard.press('Shift+ArrowRight');
  await page.keyboard.press('Enter');
  await expect(note(page)).toContainText('point 3 of 3');
  for (let by = 0; by < 4; by += 1) await page.keyboard.press('Shift+ArrowDown');
  await page.keyboard.press('Enter');
  const by = 'points-100-300-150-300-150-340';
  const plane = planeBy(by)!;
  await expect(note(page)).toContainText(
    'Heights levelled by points (100, 300), (150, 300), (150, 340) px',
  );
  await expect(note(page)).toContainText(`tilt x ${mrad(1e3 * Math.atan(plane.slopes[0] / 0.025))}, y`);
  // The last point lies on the plane.
  expect(Math.abs(levelledAt(by)(150, 340))).toBeLessThan(1e-12);
  const at = (x: number, y: number, height: (x: number, y: number) => number): string =>
    `(${x}, ${y})  ${measured(height(x, y), sigmaMmAt(x, y), 'mm')}`;
  await expect(valueOf(page)).toContainText(at(150, 340, () => 0));
  await expect(valueOf(page)).toContainText('Height, levelled by points');
  await page.keyboard.press('Shift+ArrowLeft');
  await expect(valueOf(page)).toContainText(at(140, 340, levelledAt(by)));
  const profile = page.getByRole('region', { name: 'Profile' });
  await expect(profile).toContainText('levelled by points');
  const [saved] = await Promise.all([
    page.waitForEvent('download'),
    profile.getByRole('button', { name: 'CSV' }).click(),
  ]);
  expect(saved.suggestedFilename()).toBe('profile-levelled.csv');
  const [, first] = (await readFile(await saved.path(), 'utf8')).split('\n');
  expect(Number(first!.split(',')[3])).toBeCloseTo(levelledAt(by)(100, 300), 9);
  await expectNoFaults(page, 'levelled');
  await note(page).getByRole('button', { name: 'As measured' }).click();
  await expect(note(page)).toHaveCount(0);
  await expect(valueOf(page)).toContainText(at(140, 340, heightAt));
  await expect(profile).not.toContainText('levelled');
});

test('a map levelled by its region has no tilt there, and the address keeps it', async ({ page }) => {
  await open(page, 'results/height?a=60,250,360,370&s=region');
  await page.getByRole('button', { name: 'Level by the region' }).click();
  const words = 'levelled by region (60, 250) to (359, 369) px';
  await expect(note(page)).toContainText(words);
  const panel = page.getByRole('tabpanel', { name: 'Region' });
  await expect(panel).toContainText(`Heights are ${words}`);
  await expect(panel.getByRole('row').filter({ hasText: 'tilt along x' })).toContainText('0.000 mrad');
  await expect.poll(() => page.url()).toContain('lv=region-60-250-360-370');
  await open(page, 'results/height?lv=region-60-250-360-370&p=100,300');
  await expect(note(page)).toContainText(words);
  const height = levelledAt('region-60-250-360-370')(100, 300);
  await expect(valueOf(page)).toContainText(measured(height, sigmaMmAt(100, 300), 'mm'));
  await showPanel(page, 'Pixel');
  await expect(page.getByRole('tabpanel')).toContainText(measured(height, sigmaMmAt(100, 300), 'mm'));
});

test('points in a line are refused in words, and nothing is levelled', async ({ page }) => {
  await open(page, 'results/height?lv=points-100-300-110-300-120-300&p=100,300');
  await expect(note(page)).toContainText('Not levelled: The three points lie in a line.');
  await expect(valueOf(page)).toContainText(measured(heightAt(100, 300), sigmaMmAt(100, 300), 'mm'));
  expect((await resultsOf(page)).id).toBe('mock');
  await quiet(page);
});

test('what is drawn is drawn on the map, and choosing points can be cancelled', async ({ page }) => {
  await open(page, 'results/height?d=3&s=region');
  await expect(mapOf(page)).toHaveCount(0);
  await page.getByRole('button', { name: 'Level by three points' }).click();
  await expect(mapOf(page)).toBeVisible();
  await note(page).getByRole('button', { name: 'Cancel' }).click();
  await expect(note(page)).toHaveCount(0);
});
