// The dead man's switch: a jog goes on only while a person holds it, and nothing brings it back.
// The clock of the page is stopped while a button is held, and goes on as the test says.

import { expect, test, type Page } from '@playwright/test';
import { stopClock } from './clock';
import { FakeRig } from './fake_rig';
import { REAL } from './page';
import { quiet } from './quiet';

test.skip(!!REAL, 'the rig is a fake one');

const right = (page: Page) => page.getByRole('button', { name: 'Hold to move right' });

/** How often the page tells the stage to go on, and a time in which it would do so many times. */
const KEEP_MS = 100;
const LONG_MS = 1000;

/** A rig whose page is complete, and stands still in time. */
async function opened(page: Page): Promise<FakeRig> {
  const rig = new FakeRig(page);
  await rig.open();
  // Before that the panes still grow, and the button moves away.
  await expect(page.getByRole('spinbutton', { name: 'Exposure' })).toBeVisible();
  await expect(right(page)).toBeEnabled();
  await quiet(page);
  await stopClock(page);
  return rig;
}

/** Lets time pass until the stage was told to go on twice more. */
async function goesOn(page: Page, rig: FakeRig): Promise<void> {
  const before = rig.sent('rig/keep').length;
  await expect
    .poll(
      async () => {
        await page.clock.runFor(KEEP_MS);
        return rig.sent('rig/keep').length;
      },
      { intervals: [20] },
    )
    .toBeGreaterThanOrEqual(before + 2);
}

/** Holds the button until the stage was told to go on at least twice. */
async function held(page: Page): Promise<FakeRig> {
  const rig = await opened(page);
  await right(page).hover();
  await page.mouse.down();
  await goesOn(page, rig);
  expect(rig.sent('rig/jog').map(({ asked }) => [asked.direction, asked.fast])).toEqual([[1, false]]);
  expect(rig.sent('rig/release').length).toBe(0);
  return rig;
}

/** Released once, and no word to go on, nor a new jog, after that. */
async function over(page: Page, rig: FakeRig): Promise<void> {
  await expect.poll(() => rig.sent('rig/release').length).toBe(1);
  const id = rig.sent('rig/jog')[0]!.asked.id;
  expect(rig.sent('rig/release')[0]!.asked.id).toBe(id);
  await page.clock.runFor(LONG_MS);
  await rig.heard();
  const index = rig.orders.findIndex(({ path }) => path === 'rig/release');
  const after = rig.orders.slice(index + 1).map(({ path }) => path);
  expect(after.filter((path) => path !== 'rig/stop')).toEqual([]);
}

const ENDINGS: [name: string, act: (page: Page, rig: FakeRig) => Promise<void>][] = [
  ['the button is released', (page) => page.mouse.up()],
  ['the window loses the focus', (page) => page.evaluate(() => void dispatchEvent(new Event('blur')))],
  [
    'the page is hidden',
    (page) =>
      page.evaluate(() => {
        Object.defineProperty(document, 'visibilityState', { value: 'hidden' });
        document.dispatchEvent(new Event('visibilitychange'));
      }),
  ],
  ['the page is left', (page) => page.evaluate(() => void dispatchEvent(new Event('pagehide')))],
  ['the focus goes to a field', (page) => page.getByRole('spinbutton', { name: 'go to' }).focus()],
  [
    'the browser cancels the pointer',
    (page) =>
      page.evaluate(() => {
        const button = document.querySelector('.jog.held')!;
        button.dispatchEvent(new PointerEvent('pointercancel', { pointerId: 1, bubbles: true }));
      }),
  ],
  ['a dialog opens', (page) => page.keyboard.press('?')],
  ['the view changes', (page) => page.keyboard.press('3')],
  ['STOP is pressed by key', (page) => page.keyboard.press('Escape')],
  ['control is lost', (_page, rig) => Promise.resolve(rig.tell({ controller: 'another page' }))],
  [
    'the stage is lost',
    (_page, rig) => Promise.resolve(rig.tell({ stage: { ...rig.state.stage, state: 'lost' } })),
  ],
];

for (const [name, act] of ENDINGS) {
  test(`a jog ends when ${name}`, async ({ page }) => {
    const rig = await held(page);
    await act(page, rig);
    await over(page, rig);
    if (name.startsWith('STOP')) expect(rig.sent('rig/stop').length).toBe(1);
  });
}

test('a jog ends when the contact is lost, and does not come back with it', async ({ page }) => {
  const rig = await held(page);
  await rig.vanish();
  // Beside the button may stand, too, that the word to go on was not answered.
  const gone = page.getByRole('alert').filter({ hasText: 'Server gone' });
  await expect(gone).toBeVisible();
  await expect(page.locator('.jog.held')).toHaveCount(0);
  const before = rig.sent('rig/keep').length;
  rig.unreachable = false;
  await page.clock.resume();
  await expect(gone).toHaveCount(0);
  await page.clock.runFor(LONG_MS);
  await rig.heard();
  expect(rig.sent('rig/keep').length).toBe(before);
  expect(rig.sent('rig/jog').length).toBe(1);
});

test('a jog that nobody answers is told in words', async ({ page }) => {
  const rig = await opened(page);
  rig.unreachable = true;
  await right(page).hover();
  await page.mouse.down();
  await expect(page.getByRole('alert').filter({ hasText: 'The server does not answer.' })).toBeVisible();
  await expect(page.locator('.jog.held')).toHaveCount(0);
});

test('a jog does not go on after the page was frozen', async ({ page }) => {
  const rig = await held(page);
  await page.clock.fastForward(1500);
  await over(page, rig);
});

test('keys hold, too; a key that repeats begins nothing new', async ({ page }) => {
  const rig = await opened(page);
  await page.getByRole('radio', { name: 'fast' }).check();
  await page.getByRole('button', { name: 'Hold to move left' }).focus();
  await page.keyboard.down(' ');
  await page.keyboard.down(' ');
  await goesOn(page, rig);
  expect(rig.sent('rig/jog').map(({ asked }) => [asked.direction, asked.fast])).toEqual([[-1, true]]);
  // While it moves it is the only task, and must not turn its own button off.
  rig.tell({
    task: {
      kind: 'jogging',
      words: 'jogging',
      step: null,
      done: null,
      of: null,
      seconds_left: null,
      stops: false,
    },
  });
  await expect(page.getByRole('button', { name: 'Move +1 mm' })).toBeDisabled();
  await goesOn(page, rig);
  await page.keyboard.up(' ');
  await over(page, rig);
});

test.describe('touch', () => {
  test.use({ hasTouch: true, viewport: { width: 390, height: 844 } });

  test('a finger holds', async ({ page }) => {
    const rig = await opened(page);
    await right(page).scrollIntoViewIfNeeded();
    const box = (await right(page).boundingBox())!;
    expect(box.height).toBeGreaterThanOrEqual(64);
    const client = await page.context().newCDPSession(page);
    const point = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
    await client.send('Input.dispatchTouchEvent', { type: 'touchStart', touchPoints: [point] });
    await goesOn(page, rig);
    await client.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
    await over(page, rig);
  });
});
