import { expect, test, type Download, type Page } from '@playwright/test';
import { readFile } from 'node:fs/promises';
import { colourTable } from '../../src/colours/tables';
import { expectNoFaults } from './access';
import { centre, open, REAL } from './page';
import { quiet } from './quiet';

test.beforeEach(() => test.skip(!!REAL, 'names and numbers are those of the mock server'));

/** All words that are drawn from now on. */
async function listen(page: Page): Promise<() => Promise<string[]>> {
  await page.evaluate(() => {
    const drawn: string[] = [];
    (window as unknown as { drawn: string[] }).drawn = drawn;
    const fill = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text: string, x: number, y: number): void {
      drawn.push(text);
      fill.call(this, text, x, y);
    };
  });
  return () => page.evaluate(() => (window as unknown as { drawn: string[] }).drawn);
}

interface Read {
  width: number;
  height: number;
  /** Colours of all pixels, each once, as `r,g,b`. */
  colours: Set<string>;
}

/** The PNG as the browser decodes it. */
async function read(page: Page, saved: Download): Promise<Read> {
  const bytes = await readFile(await saved.path());
  expect(bytes.subarray(1, 4).toString()).toBe('PNG');
  const found = await page.evaluate(async (base64) => {
    const blob = new Blob([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))]);
    const image = await createImageBitmap(blob);
    const canvas = document.createElement('canvas');
    [canvas.width, canvas.height] = [image.width, image.height];
    const context = canvas.getContext('2d')!;
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    const colours = new Set<string>();
    for (let at = 0; at < data.length; at += 4) colours.add(`${data[at]},${data[at + 1]},${data[at + 2]}`);
    return { width: image.width, height: image.height, colours: [...colours] };
  }, bytes.toString('base64'));
  return { ...found, colours: new Set(found.colours) };
}

async function take(page: Page, name: string): Promise<Download> {
  const [saved] = await Promise.all([
    page.waitForEvent('download'),
    page.getByRole('button', { name, exact: true }).click(),
  ]);
  return saved;
}

const viridis = colourTable('viridis');
const colour = (entry: number): string => viridis.subarray(entry * 4, entry * 4 + 3).join(',');

test('the map as PNG has its title, its colours and their unit', async ({ page }) => {
  await open(page, 'results/height?lv=region-60-250-360-370&r=-0.2,0.1');
  await expect(page.locator('.level-note')).toContainText('levelled by region');
  await centre(page);
  const words = await listen(page);
  const saved = await take(page, 'PNG');
  expect(saved.suggestedFilename()).toBe('mock-0042-height.png');
  const { width, height, colours } = await read(page, saved);
  const map = (await page.locator('.map').boundingBox())!;
  expect(width).toBeGreaterThan(map.width);
  expect(height).toBeGreaterThan(map.height);
  // All of the colour bar: both ends and the middle.
  for (const entry of [0, 128, 255]) expect(colours.has(colour(entry)), `colour ${entry}`).toBe(true);
  const drawn = (await words()).join(' ');
  for (const text of [
    'Height, levelled by region (60, 250) to (359, 369) px',
    'sequence mock-0042; results results, epirig 0.0.0',
    'pixel on the surface 0.02500 mm',
    'mm \u22120.20',
  ]) {
    expect(drawn).toContain(text);
  }
});

test('a map of codes as PNG tells what they are', async ({ page }) => {
  await open(page, 'results/mask');
  await centre(page);
  const words = await listen(page);
  expect((await take(page, 'PNG')).suggestedFilename()).toBe('mock-0042-mask.png');
  expect((await words()).join(' ')).toMatch(/answered 9\d.* leaves the image .* too uncertain/);
});

test('heights fill the pane in 3-D, with axes in mm, and as PNG', async ({ page }) => {
  await open(page, 'results/sigma');
  await centre(page);
  const map = (await page.locator('.map').boundingBox())!;
  const words = await listen(page);
  const solid = page.getByRole('button', { name: '3-D' });
  await solid.click();
  // Another map has no heights.
  await expect(page.getByLabel('Map', { exact: true })).toHaveValue('height');
  const picture = page.getByRole('img', { name: /^Surface in 3-D/ });
  await expect(page.getByText('loading…')).toHaveCount(0);
  await expect(page.getByRole('group', { name: 'Range of Height' })).toBeVisible();
  const box = (await picture.boundingBox())!;
  expect(box.width * box.height).toBeGreaterThan(0.75 * map.width * map.height);
  await expect(page.getByRole('button', { name: 'PNG', exact: true })).toBeEnabled();
  const saved = await take(page, 'PNG');
  expect(saved.suggestedFilename()).toBe('mock-0042-height-3d.png');
  const { width, colours } = await read(page, saved);
  expect(width).toBeGreaterThan(box.width);
  expect(colours.size).toBeGreaterThan(300);
  const drawn = await words();
  // The map of 640 px is 16 mm wide; 616 px of it are answered.
  for (const text of ['x (mm)', 'y (mm)', 'height (mm)', '0', '15', 'Height, in 3-D', 'mm']) {
    expect(drawn).toContain(text);
  }
  expect(drawn).not.toContain('20');
  await expectNoFaults(page, '3-D');
  await expect.poll(() => page.url()).toContain('d=3');
  await solid.click();
  await expect(page.locator('#map')).toBeVisible();
});

test('several profiles stand side by side, and as PNG', async ({ page }) => {
  await open(page, 'results/height?l=20,300,220,300,5');
  const { x, y } = await centre(page);
  const profile = page.getByRole('region', { name: 'Profile' });
  await expect(profile.getByRole('heading')).toContainText('Profile A–B');
  await profile.getByRole('button', { name: 'Add line' }).click();
  await page.mouse.move(x - 60, y);
  await page.mouse.down();
  await page.mouse.move(x, y + 5, { steps: 3 });
  await page.mouse.move(x + 80, y + 10, { steps: 3 });
  await page.mouse.up();
  await expect(profile.getByRole('heading')).toContainText('Profile C–D');
  const kept = profile.getByRole('list', { name: 'Other lines' });
  await expect(kept).toContainText('A–B (20, 300) to (220, 300), width 5 px');
  await expect(profile.getByRole('img', { name: /^Profile from C to D/ })).toBeVisible();
  await expect.poll(() => page.url()).toContain('ls=20,300,220,300,5');
  // The cursors are those of the line that was drawn last.
  await profile.getByRole('button', { name: 'Cursors' }).click();
  await expect(profile.getByRole('group', { name: 'Cursors' })).toContainText(/dx \d.* mm; dz .*sigma/);
  await quiet(page);
  const words = await listen(page);
  expect((await take(page, 'Profile as PNG')).suggestedFilename()).toBe('mock-0042-profile.png');
  expect((await words()).join(' ')).toMatch(/Profile C–D .*A–B, dashed: \(20, 300\) to \(220, 300\) px/);
  await profile.getByRole('button', { name: 'Clear', exact: true }).click();
  await expect(profile.getByRole('heading')).toContainText('(20, 300) to (220, 300) px');
  await expect(kept).toHaveCount(0);
});
