import { expect, test } from '@playwright/test';
import { FakeRig } from './fake_scan';
import { idle, scanning } from './fake_states';

test('before a scan: plan, name, start', async ({ page }) => {
  const rig = new FakeRig(page);
  await rig.open();
  const plan = page.getByRole('region', { name: 'Plan' });
  await expect(plan).toContainText('101, each the mean of 4');
  await expect(plan).toContainText('50.000 mm, from 0.000 to 50.000 mm');
  await expect(plan).toContainText('16 dark, 16 flat field, 12 chess-board');
  await expect(plan).toContainText('about 12 min');
  await expect(plan).toContainText('needs 4.60 GB, 412 GB free');
  const name = page.getByLabel('Name of the sequence');
  await expect(name).toHaveValue('tile-0414');
  await name.fill('tile-0412');
  await expect(plan).toContainText('there is a sequence of this name');
  await expect(name).toHaveAttribute('aria-invalid', 'true');
  await expect(page.getByRole('button', { name: 'Start' })).toBeDisabled();
  // The rule is that of the server, which would refuse these.
  for (const wrong of [
    'ok name u-\u00fc',
    'con: <script>',
    'x'.repeat(300),
    '.hidden',
    '../up',
    '-o',
    'a.',
  ]) {
    await name.fill(wrong);
    await expect(plan).toContainText(rig.plan.names.words);
    await expect(page.getByRole('button', { name: 'Start' })).toBeDisabled();
  }
  await name.fill('blue_tile-2.5');
  await expect(name).toHaveAttribute('aria-invalid', 'false');
  await page.getByRole('button', { name: 'Start' }).click();
  await expect.poll(() => rig.asked('scan/start')[0]?.name).toBe('blue_tile-2.5');
});

test('a plan that does not fit on the disk is not started', async ({ page }) => {
  const rig = new FakeRig(page);
  rig.plan.free_bytes = 4e9;
  await rig.open();
  await expect(page.getByText('The disk has too little room for this plan.')).toBeVisible();
  await expect(page.getByRole('button', { name: 'Start' })).toBeDisabled();
});

test('sequences are resumed, measured and opened', async ({ page }) => {
  const rig = new FakeRig(page);
  await rig.open();
  await expect(page.getByText('101 of 101 frames, complete, depth 0.2000 ± 0.0079 mm, PASS')).toBeVisible();
  await page.getByRole('button', { name: 'Resume tile-0410' }).click();
  await page.getByRole('button', { name: 'Measure tile-0411' }).click();
  await expect(page.getByRole('button', { name: 'Measure tile-0410' })).toHaveCount(0);
  await expect(page.getByRole('button', { name: 'Measure tile-0412' })).toHaveCount(0);
  rig.refusals['results/open'] = 'the results are broken';
  await page.getByRole('button', { name: 'Open results of tile-0412' }).click();
  await expect(page.getByRole('alert')).toContainText('the results are broken');
  expect(page.url()).not.toContain('#results');
  delete rig.refusals['results/open'];
  await page.getByRole('button', { name: 'Open results of tile-0412' }).click();
  await expect(page).toHaveURL(/#results\/$/);
  expect(rig.asked('scan/resume')[0]?.name).toBe('tile-0410');
  expect(rig.asked('scan/measure')[0]?.name).toBe('tile-0411');
});

test('the link to the plan of the profile opens its section', async ({ page }) => {
  const rig = new FakeRig(page);
  await rig.open();
  await page.getByRole('link', { name: 'Change the plan in the profile' }).click();
  await expect(page).toHaveURL(/#rig$/);
  await expect(page.getByLabel('step')).toHaveValue('0.5 mm');
  await expect(page.getByLabel('driver')).toHaveCount(0);
});

test('a running scan tells how far it is, and pauses', async ({ page }) => {
  const rig = new FakeRig(page);
  rig.state = scanning();
  await rig.open();
  const bar = page.getByRole('progressbar', { name: 'Scan' });
  await expect(bar).toHaveAttribute('aria-valuenow', '37');
  await expect(bar).toHaveAttribute('aria-valuemax', '101');
  await expect(bar).toHaveAttribute('aria-valuetext', '37 of 101, about 4 min left');
  await expect(page.getByText('101 frames, one every 0.500 mm, over 50.000 mm')).toBeVisible();
  const side = page.locator('.scan-side');
  await expect(side).toContainText('18.500 mm');
  await expect(side).toContainText('\u22120.4 µm');
  await expect(side).toContainText('2 retakes');
  await expect(side).toContainText('frame 29, attempt 1: mean light fell 4.1 % (limit 2 %)');
  await expect(side).toContainText('✓ enough needs 3.10 GB, 398 GB free');
  await expect(page.getByRole('log')).toContainText('14:02:11 ! frame 29 retaken');
  await expect(page.getByRole('img', { name: 'Last frame' })).toBeVisible();
  expect(rig.wishes).toContainEqual({ pixels: 120_000, live: false });
  await expect(page.getByRole('img', { name: /^Reported minus planned/ })).toBeVisible();
  await page.getByRole('button', { name: 'Pause' }).click();
  await expect.poll(() => rig.asked('scan/pause').length).toBe(1);
  rig.set(scanning({ state: 'pausing' }));
  await expect(page.getByRole('button', { name: 'Pause' })).toBeDisabled();
  rig.set(scanning({ state: 'running', done: 38, seconds_left: -40 }));
  await expect(bar).toHaveAttribute('aria-valuetext', '38 of 101, over by 0:40');
});

test('a paused scan names its holders; the operator resumes, a full disk does not', async ({ page }) => {
  const rig = new FakeRig(page);
  rig.state = scanning({ state: 'paused', held_by: ['operator'], reason: 'Stopped from bench-2.' });
  await rig.open();
  await expect(page.getByText('Paused by the operator.')).toBeVisible();
  await expect(page.getByText('Stopped from bench-2.')).toBeVisible();
  await page.getByRole('button', { name: 'Resume' }).click();
  await expect.poll(() => rig.asked('scan/resume')[0]?.name).toBe('tile-0413');
  rig.set(
    scanning({
      state: 'paused',
      held_by: ['operator', 'disk'],
      free_bytes: 1e9,
      reason: 'The disk is full.',
    }),
  );
  await expect(page.getByText('Paused by the operator and the disk.')).toBeVisible();
  await expect(page.getByRole('button', { name: 'Resume' })).toBeDisabled();
  await expect(
    page.getByText('The disk is too full: needs 3.10 GB, 1.00 GB free. Free some space.'),
  ).toBeVisible();
  await expect(page.locator('.disk.bad')).toContainText('✕ too little');
  // Let go of by itself.
  rig.set(scanning({ state: 'paused', held_by: ['operator', 'disk'], free_bytes: 4e9 }));
  await expect(page.getByRole('button', { name: 'Resume' })).toBeEnabled();
  await expect(page.locator('.disk.warning')).toContainText('! little room');
});

test('a lost camera keeps the scan paused until it is back', async ({ page }) => {
  const rig = new FakeRig(page);
  const paused = scanning({ state: 'paused', held_by: ['camera'], reason: 'No picture for 10 s.' });
  rig.state = { ...paused, camera: { ...paused.camera, state: 'lost' } };
  await rig.open();
  await expect(page.getByRole('button', { name: 'Resume' })).toBeDisabled();
  await page.getByRole('button', { name: 'Connect again' }).click();
  await expect.poll(() => rig.asked('rig/reconnect').length).toBe(1);
  rig.set(paused);
  await expect(page.getByRole('button', { name: 'Resume' })).toBeEnabled();
});

test('a failed scan says why, and another one can begin', async ({ page }) => {
  const rig = new FakeRig(page);
  rig.state = scanning({ state: 'failed', reason: 'The stage did not reach 18.500 mm.' });
  await rig.open();
  await expect(page.getByRole('alert')).toContainText('Failed after 37 of 101 frames.');
  await expect(page.getByRole('alert')).toContainText('The stage did not reach 18.500 mm.');
  await expect(page.getByRole('button', { name: 'Resume' })).toHaveCount(0);
  await page.getByRole('button', { name: 'New scan' }).click();
  await expect(page.getByRole('region', { name: 'Plan' })).toBeVisible();
  await page.getByRole('button', { name: 'Back to tile-0413' }).click();
  await expect(page.getByRole('alert')).toBeVisible();
});

test('a scan that is done is measured, and its results are opened', async ({ page }) => {
  const rig = new FakeRig(page);
  const done = scanning({ state: 'done', done: 101 });
  rig.state = done;
  await rig.open();
  await expect(page.getByText('Done: 101 frames.')).toBeVisible();
  await page.getByRole('button', { name: 'Measure' }).click();
  await expect.poll(() => rig.asked('scan/measure')[0]?.name).toBe('tile-0413');
  const task = { kind: 'measuring' as const, words: 'measuring tile-0413' };
  rig.set({
    ...done,
    task: { ...task, step: 'matching', done: 3, of: 12, seconds_left: 50, stops: false },
  });
  const bar = page.getByRole('progressbar', { name: 'Measurement' });
  await expect(bar).toHaveAttribute('aria-valuetext', 'matching, 3 of 12, about 50 s left');
  await expect(bar).toHaveAttribute('aria-valuenow', '3');
  await expect(page.getByRole('button', { name: 'Measure' })).toBeDisabled();
  rig.set({ ...done, scan: { ...done.scan!, measured: true } });
  await page.getByRole('button', { name: 'Open results' }).click();
  await expect(page).toHaveURL(/#results\/$/);
  expect(rig.asked('results/open')[0]?.name).toBe('tile-0413');
});

test('what the scan asks for is a card with a live picture', async ({ page }) => {
  const rig = new FakeRig(page);
  const asked = {
    kind: 'board' as const,
    words: 'Hold the chess-board, tilted to the left.',
    pose: 3,
    poses: 12,
    by_itself: true,
    waiting_for: 'the board to be still',
  };
  const state = scanning({ map: null, course: [], stops: [], done: 0, asked });
  rig.state = {
    ...state,
    target: {
      name: 'board',
      wanted: 54,
      corners: [
        [100, 100],
        [200, 120],
      ],
      complete: false,
      blur_px: 0.4,
      coverage_columns: 3,
      coverage_rows: 2,
      coverage: [true, true, false, true, false, false],
    },
  };
  await rig.open();
  const card = page.getByRole('region', { name: 'What to do' });
  await expect(card).toContainText('Hold the chess-board, tilted to the left.');
  await expect(card).toContainText('pose 3 of 12');
  await expect(card).toContainText('taken by itself when the board is still');
  await expect(card).toContainText('Waiting for: the board to be still');
  await expect(card.getByRole('img', { name: 'Live picture' })).toBeVisible();
  await expect(card.getByRole('img', { name: 'Coverage: 3 of 6 parts of the picture' })).toBeVisible();
  await expect(card).toContainText('corners found 2 of 54');
  expect(rig.wishes).toContainEqual({ pixels: 120_000, live: true });
  await card.getByRole('button', { name: 'Done, take it' }).click();
  await card.getByRole('button', { name: 'Cancel' }).click();
  await expect.poll(() => rig.asked('scan/arranged').map(({ done }) => done)).toEqual([true, false]);
  rig.set(scanning());
  await expect(card).toHaveCount(0);
  await expect(page.getByRole('img', { name: 'Disparity map' })).toBeVisible();
});

test('a reload in the middle of a scan shows the same', async ({ page }) => {
  const rig = new FakeRig(page);
  rig.state = scanning({ state: 'paused', held_by: ['operator'] });
  await rig.open();
  await expect(page.getByText('Paused by the operator.')).toBeVisible();
  await page.reload();
  await expect(page.getByText('Paused by the operator.')).toBeVisible();
  await expect(page.getByRole('progressbar', { name: 'Scan' })).toHaveAttribute('aria-valuenow', '37');
  await expect(page.getByText('stops 1–37 of 101')).toBeVisible();
  await expect(page.getByRole('img', { name: /^Median sigma/ }).locator('canvas')).toBeVisible();
  await page.getByRole('button', { name: 'Resume' }).click();
  await expect.poll(() => rig.asked('scan/resume').length).toBe(1);
});

test('without the token there are no buttons; with another controller they say why they do nothing', async ({
  page,
}) => {
  const rig = new FakeRig(page);
  rig.state = scanning();
  await rig.open('scan', '');
  await expect(page.getByRole('progressbar', { name: 'Scan' })).toBeVisible();
  await expect(page.getByRole('button', { name: 'Pause' })).toHaveCount(0);
  await rig.heard();
  expect(rig.orders).toEqual([]);
  await page.goto('about:blank');
  rig.state = { ...idle(), controller: 'another' };
  await page.goto('http://epirig.test/#token=secret');
  await expect(page.getByText('Another page has control.').first()).toBeVisible();
  // All buttons of the view are there: of the plan, and of the list.
  await expect(page.getByRole('button', { name: 'Start' })).toBeVisible();
  await expect(page.getByRole('button', { name: 'Measure tile-0411' })).toBeVisible();
  await expect(page.getByRole('button', { disabled: false })).toHaveCount(0);
});
