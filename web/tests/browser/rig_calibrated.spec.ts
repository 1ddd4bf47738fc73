import { expect, test, type Page } from '@playwright/test';
import type { Results } from '../../src/api';
import type { RigState } from '../../src/rig/api';

// The whole program with a simulated rig that has a lens, uneven light and a stage with errors: EPIRIG_CALIBRATED
// is the link that `epirig ui` prints, for a folder without sequences and the rig that `.ci/run` names.
const LINK = process.env.EPIRIG_CALIBRATED;
test.skip(!LINK, 'needs the link of epirig ui with a rig to calibrate');

const TRUE_DISTANCE_MM = 900;
/** The distance is as good as the focal length, which these boards tell to 0.01 %; ten times that. */
const TOLERANCE = 0.001;

async function api<T>(page: Page, path: string): Promise<T> {
  const address = new URL(LINK!);
  const reply = await page.request.get(`${address.origin}/api/${path}`, {
    headers: { 'x-epirig-token': address.hash.replace('#token=', '') },
  });
  expect(reply.ok(), `${path}: ${reply.status()}`).toBe(true);
  return (await reply.json()) as T;
}

test('a board held by hand is photographed by itself, and the rig is calibrated with it', async ({
  page,
}) => {
  test.setTimeout(600_000);
  await page.goto(LINK!.replace('#token=', '#scan?token='));
  await page.getByRole('button', { name: 'Start', exact: false }).first().click();
  // The simulated board is put into one pose after the other. Nobody presses anything.
  const asked = page.getByRole('region', { name: 'What to do' });
  await expect(asked).toContainText('pose 2 of 8');
  await expect(asked.getByRole('img', { name: /Coverage: [1-9]/ })).toBeVisible();
  await expect(asked).toContainText('pose 8 of 8');
  const state = (): Promise<RigState> => api<RigState>(page, 'rig/state');
  await expect.poll(async () => (await state()).scan?.state, { timeout: 120_000 }).toBe('done');
  await expect.poll(async () => (await state()).task).toBeNull();
  await page.getByRole('button', { name: 'Measure', exact: false }).first().click();
  await expect.poll(async () => (await state()).scan?.measured, { timeout: 120_000 }).toBe(true);
  await page.getByRole('button', { name: 'Open results', exact: false }).first().click();
  await page.getByRole('tab', { name: 'Calibration' }).click();
  await expect(page.getByRole('img', { name: 'Lens residuals' })).toBeVisible();
  await expect(page.getByRole('img', { name: 'Flat field', exact: true })).toBeVisible();
  const { results, geometry } = await api<Results>(page, 'results');
  expect(results?.calibrated).toBe(true);
  expect(Math.abs(geometry!.distance_mm / TRUE_DISTANCE_MM - 1)).toBeLessThan(TOLERANCE);
});
