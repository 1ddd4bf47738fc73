import { expect, test, type Page } from '@playwright/test';
import { stopClock } from './clock';
import { FakeRig } from './fake_scan';

async function open(page: Page): Promise<FakeRig> {
  const rig = new FakeRig(page);
  rig.check = (values) =>
    values['plan.step'] === undefined || values['plan.step'].endsWith('mm')
      ? []
      : [{ key: 'plan.step', words: 'plan.step has no unit; write 3 mm.' }];
  await rig.open('profile');
  await page.getByText('The scan: positions and frames').click();
  return rig;
}

test('values are checked as they are typed, mistakes stand at their field', async ({ page }) => {
  const rig = await open(page);
  const step = page.getByLabel('step');
  await expect(step).toHaveValue('0.5 mm');
  await expect(page.getByLabel('start')).toHaveAttribute('placeholder', '0 mm');
  await step.fill('3');
  await expect(step).toHaveAttribute('aria-invalid', 'true');
  const described = (await step.getAttribute('aria-describedby'))!.split(' ');
  await expect(page.locator(`#${described[0]}`)).toContainText('plan.step has no unit; write 3 mm.');
  await expect(page.locator(`#${described[1]}`)).toContainText('Distance between stops.');
  await expect(page.getByRole('button', { name: 'Use now' })).toBeDisabled();
  await expect(page.getByRole('button', { name: 'Save to' })).toBeDisabled();
  await step.fill('3 mm');
  await expect(step).toHaveAttribute('aria-invalid', 'false');
  // Only what was changed is sent.
  expect(rig.asked('rig/profile/check').map(({ values }) => values)).toEqual([
    { 'plan.step': '3' },
    { 'plan.step': '3 mm' },
  ]);
  await page.getByRole('button', { name: 'Use now' }).click();
  await expect.poll(() => rig.asked('rig/profile/use')[0]?.values).toEqual({ 'plan.step': '3 mm' });
});

test('fast typing is checked once', async ({ page }) => {
  const rig = await open(page);
  await expect(page.getByLabel('frames')).toBeVisible();
  await stopClock(page);
  const checks = (): unknown[] => rig.asked('rig/profile/check').map(({ values }) => values);
  for (const text of ['2', '20', '201']) {
    await page.getByLabel('frames').fill(text);
    await page.clock.runFor(200);
  }
  await rig.heard();
  expect(checks()).toEqual([]);
  await page.clock.runFor(200);
  await expect(page.getByText('1 changed, no mistakes')).toBeVisible();
  expect(checks()).toEqual([{ 'plan.frames': '201' }]);
});

test('changes are undone, and an empty text means not set', async ({ page }) => {
  const rig = await open(page);
  rig.check = () => [{ key: null, words: 'A scan needs a step.' }];
  await page.getByLabel('step').fill('');
  await expect(page.getByRole('alert')).toContainText('A scan needs a step.');
  expect(rig.asked('rig/profile/check')[0]?.values).toEqual({ 'plan.step': '' });
  await page.getByRole('button', { name: 'Undo changes' }).click();
  await expect(page.getByLabel('step')).toHaveValue('0.5 mm');
  await expect(page.getByText('no changes')).toBeVisible();
  await expect(page.getByRole('alert')).toHaveCount(0);
});

test('saving asks before it replaces a file', async ({ page }) => {
  const rig = await open(page);
  await page.getByLabel('step').fill('1 mm');
  rig.refusals['rig/profile/save'] = '/data/bench.toml exists already.';
  await page.getByRole('button', { name: 'Save to /data/bench.toml' }).click();
  const question = page.getByRole('alertdialog', { name: 'Replace the file?' });
  await expect(question).toContainText('/data/bench.toml exists already. Replace it?');
  await question.getByRole('button', { name: 'Keep the file' }).click();
  await expect(question).toHaveCount(0);
  await page.getByRole('button', { name: 'Save to /data/bench.toml' }).click();
  // The refusal must have come before the file may be replaced.
  await expect(question).toBeVisible();
  delete rig.refusals['rig/profile/save'];
  await question.getByRole('button', { name: 'Replace' }).click();
  await expect(page.getByRole('status', { name: 'Notice' })).toHaveText('Saved to /data/bench.toml.');
  expect(rig.asked('rig/profile/save').map(({ overwrite }) => overwrite)).toEqual([false, false, true]);
  expect(rig.asked('rig/profile/save')[2]?.values).toEqual({ 'plan.step': '1 mm' });
});

test('choices are chosen; keys without effect are shown on demand; controls are listed', async ({
  page,
}) => {
  const rig = await open(page);
  await page.getByText('The stage and its connection').click();
  await page.getByLabel('driver').selectOption('grbl');
  await page.getByLabel('relative').selectOption('true');
  await expect
    .poll(() => rig.asked('rig/profile/check').pop()?.values)
    .toEqual({ 'stage.driver': 'grbl', 'stage.relative': 'true' });
  await expect(page.getByLabel('port')).toHaveCount(0);
  await page.getByLabel('show all (1 without effect)').check();
  await expect(page.getByLabel('port')).toBeVisible();
  await expect(page.getByText('No effect with this driver.')).toBeVisible();
  await page.getByText('The camera and its settings').click();
  await expect(page.getByRole('row', { name: 'black_level' })).toContainText('64');
});

test('while another page has control, nothing can be typed or sent', async ({ page }) => {
  const rig = await open(page);
  rig.set({ ...rig.state, controller: 'another' });
  await expect(page.getByLabel('step')).toBeDisabled();
  await expect(page.getByRole('button', { name: 'Use now' })).toBeDisabled();
  await expect(page.getByText('This page has no control of the rig.')).toBeVisible();
});
