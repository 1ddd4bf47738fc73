// All sequences: the table, two of them compared, and the control chart.

import { expect, test, type Page } from '@playwright/test';
import { sorted } from '../../src/sequences/rows';
import { SEQUENCES, sequenceList } from '../mock/sequences';
import { checkAt, SIZES } from './access';
import { FakeRig } from './fake_rig';
import { REAL } from './page';
import { quiet } from './quiet';

test.skip(!!REAL, 'the sequences are those of the mock server');

async function opened(page: Page, count = 60, token = true): Promise<FakeRig> {
  const rig = new FakeRig(page, { token });
  rig.sequences = count === 60 ? SEQUENCES : sequenceList(count);
  await rig.open('sequences');
  await expect(page.getByRole('region', { name: 'List of sequences' })).toBeVisible();
  return rig;
}

const table = (page: Page) => page.getByRole('region', { name: 'List of sequences' });

/** The names in the table from above. */
const names = (page: Page): Promise<string[]> => table(page).locator('.row-name').allInnerTexts();

test('the table tells of each sequence, with a picture', async ({ page }) => {
  await opened(page);
  const row = page.getByRole('row', { name: 'friday/tile-0058' });
  await expect(row).toContainText('2026-09-02 13:00');
  await expect(row).toContainText(/measured\s*0\.20\d\d ± 0\.0018 mm\s*(PASS|UNDECIDED)/);
  const picture = row.getByRole('img', { name: 'Heights' });
  await expect(picture).toBeVisible();
  expect(await picture.evaluate((image: HTMLImageElement) => image.naturalWidth)).toBe(96);
  await expect(page.getByRole('row', { name: 'friday/tile-0054' })).toContainText('calibrated');
  // The newest is the first; what cannot be read has no day.
  await expect(table(page).locator('.row-name').first()).toHaveText('friday/tile-0059');
  await page.getByRole('button', { name: 'begun' }).click();
  await expect(table(page).locator('.row-name').first()).toHaveText('friday/tile-0049');
  await expect(page.getByRole('row', { name: 'friday/tile-0049' })).toContainText('restore it from a copy');
});

test('columns sort, and the filter leaves out rows', async ({ page }) => {
  await opened(page);
  const depth = page.getByRole('columnheader', { name: 'depth' });
  await depth.getByRole('button').click();
  await expect(depth).toHaveAttribute('aria-sort', 'ascending');
  await depth.getByRole('button').press('Enter');
  await expect(depth).toHaveAttribute('aria-sort', 'descending');
  await expect(table(page).locator('.row-name').first()).toHaveText('monday/tile-0007');
  await page.getByRole('searchbox').fill('fail');
  await expect(page.getByRole('status').filter({ hasText: 'of 60 sequences' })).toHaveText(
    '1 of 60 sequences',
  );
  expect(await names(page)).toEqual(['monday/tile-0007']);
  await expect(page.getByText('Fewer than two of these sequences')).toBeVisible();
  await page.getByRole('searchbox').fill('friday measured');
  await expect(page.getByRole('slider')).toHaveAttribute('aria-valuemax', '26');
});

test('of a thousand rows only those on the screen are there, and pictures are asked for once', async ({
  page,
}) => {
  const asked: string[] = [];
  page.on('request', (request) => {
    const picture = /\/api\/sequences\/(picture-\d+)$/.exec(request.url())?.[1];
    if (picture) asked.push(picture);
  });
  await opened(page, 1000);
  await expect(page.getByRole('status').filter({ hasText: '1000 sequences' })).toBeVisible();
  await quiet(page);
  const drawn = await table(page).locator('.row-name').count();
  expect(drawn).toBeLessThan(40);
  expect(asked.length).toBeLessThanOrEqual(drawn);
  // The newest is the first.
  const order = sorted(sequenceList(1000), { column: 'created', descending: true });
  const row = (index: number) => page.getByRole('row', { name: order[index]!.name });
  await table(page).evaluate((box) => box.scrollTo(0, 500 * 56));
  await expect(row(500)).toBeInViewport();
  await expect(row(0)).toHaveCount(0);
  expect(await table(page).locator('.row-name').count()).toBeLessThan(40);
  await table(page).evaluate((box) => box.scrollTo(0, box.scrollHeight));
  await expect(row(999)).toBeInViewport();
  // By key: the table scrolls, and the focus goes on to rows that were not drawn before.
  await table(page).focus();
  await page.keyboard.press('Home');
  await expect(row(0)).toBeInViewport();
});

test('a name opens its results', async ({ page }) => {
  const rig = await opened(page);
  await page.getByRole('button', { name: 'friday/tile-0058' }).click();
  await expect(page.getByRole('img', { name: 'Height map' })).toBeVisible();
  expect(rig.sent('results/open').map(({ asked }) => asked.name)).toEqual(['friday/tile-0058']);
  // The view is as it was.
  await page.getByRole('link', { name: 'Sequences' }).click();
  await expect(page.getByRole('row', { name: 'friday/tile-0058' })).toContainText('(open)');
});

test('two that are chosen are compared, and others can be chosen there', async ({ page }) => {
  const rig = await opened(page);
  const compare = page.getByRole('button', { name: 'Compare' });
  await expect(compare).toBeDisabled();
  await page.getByLabel('Choose friday/tile-0057 to compare').check();
  await page.getByLabel('Choose friday/tile-0058 to compare').check();
  await expect(page.getByLabel('Choose friday/tile-0056 to compare')).toBeDisabled();
  // What was not measured cannot be chosen.
  await expect(page.getByLabel('Choose friday/tile-0054 to compare')).toHaveCount(0);
  await expect(page.getByText('friday/tile-0058 minus friday/tile-0057')).toBeVisible();
  const question = page.waitForRequest('**/api/sequences/compare');
  await compare.click();
  expect((await question).postDataJSON()).toMatchObject({ sequence: 'friday/tile-0057', of: 'mock' });
  expect(rig.sent('results/open').map(({ asked }) => asked.name)).toEqual(['friday/tile-0058']);
  const panel = page.getByRole('tabpanel', { name: 'Compare' });
  await expect(panel.getByRole('table')).toContainText('This minus friday/tile-0057');
  await expect(panel).toContainText('shifted by 1.42 px to the right and −0.610 px down');
  await expect(panel.getByLabel('with')).toHaveValue('sequence/friday/tile-0057');
  await expect(page.getByLabel('Map', { exact: true })).toHaveValue('difference');
  // The address leads there again; another choice is another comparison.
  await expect.poll(() => page.url()).toContain('cs=friday%2Ftile-0057');
  const other = page.waitForRequest('**/api/sequences/compare');
  await panel.getByLabel('with').selectOption('sequence/friday/tile-0056');
  expect((await other).postDataJSON()).toMatchObject({ sequence: 'friday/tile-0056' });
  await panel.getByLabel('with').selectOption('results/look');
  await expect(panel.getByRole('table')).toContainText('This minus look');
  await expect(panel).not.toContainText('shifted by');
  // Another sequence is not compared with it.
  await page.getByLabel('Sequence', { exact: true }).selectOption('friday/tile-0055');
  await expect.poll(() => page.url()).not.toContain('cs=');
});

test('the chart marks values in words, and leads to their sequences', async ({ page }) => {
  const rig = await opened(page);
  const chart = page.getByRole('slider', { name: 'Control chart of depth' });
  await expect(chart).toHaveAttribute('aria-valuemax', '53');
  const marked = page.getByRole('region', { name: 'Marked values' });
  await expect(marked).toContainText('monday/tile-0007');
  await expect(marked).toContainText('beyond three standard deviations; too far from the one before');
  await expect(page.getByText('The mean has changed by +0.00')).toBeVisible();
  // By key.
  await chart.focus();
  await page.keyboard.press('Home');
  await expect(chart).toHaveAttribute(
    'aria-valuetext',
    /^monday\/tile-0000, 2026-09-01 08:00:00Z: 0\.\d+ mm, sigma/,
  );
  await page.keyboard.press('ArrowRight');
  await expect(chart).toHaveAttribute('aria-valuenow', '2');
  // By pointer: the eighth scan is the seventh that was measured.
  const box = (await chart.boundingBox())!;
  const across = box.width - 66 - 48;
  const at = { x: 66 + (6.5 / 53) * across, y: 60 };
  await chart.hover({ position: at });
  await expect(page.locator('.chart-words')).toContainText('monday/tile-0007');
  await chart.click({ position: at });
  await expect
    .poll(() => rig.sent('results/open').map(({ asked }) => asked.name))
    .toEqual(['monday/tile-0007']);
  await page.getByRole('link', { name: 'Sequences' }).click();
  await page.getByLabel('quantity').selectOption('noise');
  await expect(
    page.getByText('Fewer than two of these sequences have this quantity; choose'),
  ).toBeVisible();
});

test('a page that only watches sees all and opens nothing', async ({ page }) => {
  await opened(page, 60, false);
  await expect(page.getByRole('row', { name: 'friday/tile-0058' })).toBeVisible();
  await expect(page.getByRole('slider')).toBeVisible();
  await expect(page.getByRole('button', { name: 'friday/tile-0058' })).toHaveCount(0);
  await expect(page.getByRole('button', { name: 'Compare' })).toHaveCount(0);
});

test('the keys lead to the view and back', async ({ page }) => {
  await opened(page);
  await page.keyboard.press('1');
  await expect(page).toHaveURL(/#rig$/);
  await page.keyboard.press('4');
  await expect(page).toHaveURL(/#sequences$/);
  await expect(page).toHaveTitle('sequences - epirig');
});

for (const [size, width, height] of SIZES) {
  test(`the sequences have no faults of access, ${size}`, async ({ page }) => {
    test.slow();
    await page.setViewportSize({ width, height });
    await page.emulateMedia({ colorScheme: 'dark' });
    await opened(page);
    await page.getByLabel('Choose friday/tile-0057 to compare').check();
    await expect(page.getByRole('slider')).toBeVisible();
    await quiet(page);
    await checkAt(page, size, 'sequences');
  });

  for (const theme of ['dark', 'light'] as const) {
    test(`look at the sequences, ${size}, ${theme}`, async ({ page }) => {
      test.skip(!process.env.LOOK, 'set LOOK=1 to take pictures');
      await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: theme });
      await opened(page, 1000);
      await expect(page.getByRole('slider')).toBeVisible();
      await quiet(page);
      await page.screenshot({ path: `screenshots/sequences-${size}-${theme}.png` });
    });
  }
}
