import { expect, test, type Page } from '@playwright/test';
import { colourTable } from '../../src/colours/tables';
import { measured, spoken } from '../../src/format/number';
import { colourAt, coloursIn } from './colour_at';
import { COLUMNS, disparityOf, FakeRig, ROWS, sigmaOf } from './fake_scan';
import { scanning } from './fake_states';
import { quiet } from './quiet';

/** The middle of a cell on the screen: the whole map is shown, as large as it fits. */
async function placeOf(page: Page, row: number, column: number): Promise<{ x: number; y: number }> {
  const box = (await page.locator('.map-values').boundingBox())!;
  const zoom = Math.min(box.width / COLUMNS, box.height / ROWS);
  return {
    x: Math.floor(box.x + box.width / 2 + (column + 0.5 - COLUMNS / 2) * zoom),
    y: Math.floor(box.y + box.height / 2 + (row + 0.5 - ROWS / 2) * zoom),
  };
}

async function expectColour(page: Page, cell: [number, number], wanted: number[]): Promise<void> {
  await expect
    .poll(async () => {
      const { x, y } = await placeOf(page, ...cell);
      const got = await colourAt(page, x, y);
      return Math.max(...got.map((value, channel) => Math.abs(value - wanted[channel]!)));
    })
    .toBeLessThanOrEqual(3);
}

function entry(name: 'viridis' | 'magma', position: number): number[] {
  const at = Math.round(position * 255) * 4;
  return [...colourTable(name).slice(at, at + 3)];
}

/** Only these colours are in a row of `width` px that begins at a cell; every `step`th px counts. */
async function expectColours(
  page: Page,
  cell: [number, number],
  { width, step }: { width: number; step: number },
  wanted: string[],
): Promise<void> {
  await expect
    .poll(async () => coloursIn(page, { ...(await placeOf(page, ...cell)), width, height: 1 }, step))
    .toEqual(wanted);
}

/** Opens a running scan; its map, its curves and its last frame are on the screen. */
async function open(page: Page): Promise<FakeRig> {
  const rig = new FakeRig(page);
  rig.state = scanning();
  await rig.open();
  await expect(page.getByText('stops 1–37 of 101')).toBeVisible();
  await expect(page.getByRole('img', { name: 'Disparity map' })).toBeVisible();
  await expect(page.getByRole('img', { name: 'Last frame' })).toBeVisible();
  await quiet(page);
  return rig;
}

test('disparity is viridis over its range, and what has no answer is a checkerboard', async ({ page }) => {
  await open(page);
  for (const [row, column] of [
    [2, 2],
    [20, 28],
    [4, 60],
  ] as const) {
    await expectColour(page, [row, column], entry('viridis', (disparityOf(row, column) - 20) / 0.8));
  }
  await expectColours(page, [44, 60], { width: 16, step: 4 }, ['58,66,77', '74,83,94']);
});

test('sigma is magma on a log scale, dark where it is small', async ({ page }) => {
  await open(page);
  await page.getByRole('combobox', { name: 'Map' }).selectOption('sigma');
  await expect(page.getByRole('img', { name: 'Sigma map' })).toBeVisible();
  const position = (column: number): number => Math.log(sigmaOf(4, column, 37) / 0.005) / Math.log(4);
  await expectColour(page, [4, 4], entry('magma', position(4)));
  await expectColour(page, [4, 40], entry('magma', position(40)));
  expect(entry('magma', position(4))[0]!).toBeLessThan(entry('magma', position(40))[0]!);
  // The last 16 columns are above the range: stripes, if one asks for them.
  await page.getByLabel('clipped').check();
  // They are 23 % of the cells with an answer.
  await expectColours(page, [4, 60], { width: 6, step: 1 }, ['0,0,0', '255,255,255']);
  await expect(page.getByRole('group', { name: 'Colours of the sigma map' })).toContainText('over 23 %');
});

test('the pin tells the value with its sigma, by pointer and by keys', async ({ page }) => {
  await open(page);
  const { x, y } = await placeOf(page, 20, 28);
  await page.mouse.click(x, y);
  const value = page.getByRole('status', { name: 'Value at pixel' });
  const text = measured(disparityOf(20, 28), sigmaOf(20, 28, 37), 'px');
  expect(text).toBe('20.340 px, sigma 0.011');
  await expect(value).toContainText(`at (228, 164): ${text}`);
  await expect(value).toContainText(spoken(disparityOf(20, 28), sigmaOf(20, 28, 37), 'px'));
  await page.getByRole('img', { name: 'Disparity map' }).focus();
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('Shift+ArrowUp');
  await expect(value).toContainText('at (236, 84): ');
  await expect(value).toContainText(measured(disparityOf(10, 29), sigmaOf(10, 29, 37), 'px'));
  for (let step = 0; step < 7; step += 1) await page.keyboard.press('Shift+ArrowRight');
  for (let step = 0; step < 7; step += 1) await page.keyboard.press('Shift+ArrowDown');
  await expect(value).toContainText('at (508, 380): no value');
});

test('another map comes with another number; its range is held', async ({ page }) => {
  const rig = await open(page);
  await expect(page.getByText('range held at stop 37')).toBeVisible();
  await expect(page.getByText('sigma median 0.0091 px = 0.0012 mm')).toBeVisible();
  await expect(page.getByText('(was 0.0240 at stop 12)')).toBeVisible();
  // The pin, in the middle of the map, tells by its sigma which map is shown.
  await page.getByRole('img', { name: 'Disparity map' }).focus();
  await page.keyboard.press('ArrowRight');
  const expectMapOf = (frames: number): Promise<void> =>
    expect(page.getByRole('status', { name: 'Value at pixel' })).toContainText(
      measured(disparityOf(24, 32), sigmaOf(24, 32, frames), 'px'),
    );
  await expectMapOf(37);
  await rig.heard();
  const asked = rig.mapsAsked.length;
  rig.range.disparity = [20.2, 20.65];
  const next = (number: number, frames: number): ReturnType<typeof scanning> =>
    scanning({ done: frames, map: { number, frames, sigma_px: 0.008, sigma_mm: null } });
  rig.set(next(5, 37));
  rig.set(next(6, 43));
  await expect(page.getByText('stops 1–43 of 101')).toBeVisible();
  await expectMapOf(43);
  expect(rig.mapsAsked.length).toBe(asked + 2);
  await expect(page.getByText('range held at stop 37')).toBeVisible();
  await expectColour(page, [4, 60], entry('viridis', (disparityOf(4, 60) - 20) / 0.8));
  rig.range.disparity = [19.9, 20.5];
  rig.set(next(7, 50));
  await expect(page.getByText('range held at stop 50')).toBeVisible();
  await expectColour(page, [4, 60], entry('viridis', (disparityOf(4, 60) - 19.9) / 0.9));
  await page.getByRole('button', { name: 'auto' }).click();
  await expectColour(page, [4, 28], entry('viridis', (disparityOf(4, 28) - 19.9) / 0.6));
});

test('a hidden page asks for no map', async ({ page }) => {
  const rig = await open(page);
  const hide = (state: string): Promise<void> =>
    page.evaluate((now) => {
      Object.defineProperty(document, 'visibilityState', { configurable: true, get: () => now });
      document.dispatchEvent(new Event('visibilitychange'));
    }, state);
  await hide('hidden');
  const asked = rig.mapsAsked.length;
  rig.set(scanning({ done: 43, map: { number: 6, frames: 43, sigma_px: 0.008, sigma_mm: null } }));
  await expect(page.getByText('stops 1–43 of 101')).toBeVisible();
  await rig.heard();
  expect(rig.mapsAsked.length).toBe(asked);
  await hide('visible');
  await expect.poll(() => rig.mapsAsked.length).toBe(asked + 2);
});
