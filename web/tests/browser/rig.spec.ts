import { expect, test, type Page } from '@playwright/test';
import { stopClock } from './clock';
import { coloursIn, coloursOf } from './colour_at';
import { FakeRig } from './fake_rig';
import { open, REAL } from './page';
import { FRAME, greyAt } from './picture';
import { quiet } from './quiet';

test.skip(!!REAL, 'the rig is a fake one');

async function opened(page: Page, options = {}, hash = ''): Promise<FakeRig> {
  const rig = new FakeRig(page, options);
  await rig.open(hash);
  return rig;
}

const live = (page: Page) => page.getByRole('img', { name: 'Live picture' });
const stopButton = (page: Page) => page.getByRole('button', { name: 'STOP' });

/** Where the live picture is, once it is there: what lies around it has come, too. */
async function placeOf(page: Page): Promise<{ x: number; y: number; width: number; height: number }> {
  await expect(page.locator('.bar-rate')).toContainText('ms old');
  await quiet(page);
  return (await live(page).boundingBox())!;
}

test.describe('views', () => {
  test('the page starts at the rig, and keys and tabs lead to the others', async ({ page }) => {
    await opened(page);
    await expect(live(page)).toBeVisible();
    const tab = (name: string) => page.getByRole('link', { name, exact: true });
    await expect(tab('Rig')).toHaveAttribute('aria-current', 'page');
    await page.keyboard.press('3');
    await expect(page.getByRole('img', { name: 'Height map' })).toBeVisible();
    await expect(tab('Results')).toHaveAttribute('aria-current', 'page');
    await expect(page).toHaveURL(/#results\//);
    await tab('Scan').click();
    await expect(page.getByRole('region', { name: 'Plan' })).toBeVisible();
    await expect(page).toHaveURL(/#scan$/);
    await expect(stopButton(page)).toBeVisible();
    await page.goBack();
    await expect(page.getByRole('img', { name: 'Height map' })).toBeVisible();
    await page.keyboard.press('1');
    await expect(live(page)).toBeVisible();
    await expect(page).toHaveURL(/#rig$/);
  });

  test('an address with a view opens that view, and the token leaves it', async ({ page }) => {
    await opened(page, {}, 'results/height?p=452,150');
    await expect(page.getByRole('tabpanel')).toContainText('At (452, 150)');
    expect(page.url()).not.toContain('token');
    await page.reload();
    await expect(page.getByRole('tabpanel')).toContainText('At (452, 150)');
    await page.unrouteAll({ behavior: 'ignoreErrors' });
  });

  test('without a sequence the results are a list to choose from', async ({ page }) => {
    const rig = await opened(page, { sequence: null }, 'results/');
    await expect(page.getByRole('row', { name: 'mock-0042' })).toContainText(/0.2000 ± 0.0079 mm\s*PASS/);
    await page.getByRole('button', { name: 'mock-0042' }).click();
    await expect(page.getByRole('img', { name: 'Height map' })).toBeVisible();
    expect(rig.sent('results/open')[0]?.asked).toMatchObject({ name: 'mock-0042' });
    await page.getByLabel('Sequence').selectOption('set-0411');
    await expect.poll(() => rig.sent('results/open').length).toBe(2);
    await expect(page.getByLabel('Sequence')).toHaveValue('set-0411');
  });

  test('epirig view has no STOP, no tabs and no feed', async ({ page }) => {
    let sockets = 0;
    page.on('websocket', () => (sockets += 1));
    await open(page);
    await expect(page.getByRole('img', { name: 'Height map' })).toBeVisible();
    await expect(stopButton(page)).toHaveCount(0);
    await expect(page.getByRole('link', { name: 'Rig' })).toHaveCount(0);
    await page.keyboard.press('1');
    await expect(page.getByRole('img', { name: 'Height map' })).toBeVisible();
    expect(sockets).toBe(0);
  });
});

test.describe('STOP', () => {
  for (const view of ['rig', 'scan', 'results/height']) {
    test(`by button and by key at ${view}`, async ({ page }) => {
      const rig = await opened(page, {}, view);
      // Without a reply in time STOP is sent again, and more would be counted here than presses.
      await stopClock(page);
      await stopButton(page).click();
      await expect.poll(() => rig.sent('rig/stop').length).toBe(1);
      await page.keyboard.press('Escape');
      await expect.poll(() => rig.sent('rig/stop').length).toBe(2);
      await page.keyboard.press('Pause');
      await expect.poll(() => rig.sent('rig/stop').length).toBe(3);
    });
  }

  test('in a dialog, by key and by button, and in an input', async ({ page }) => {
    const rig = await opened(page);
    await page.getByRole('button', { name: 'Keys' }).click();
    const dialog = page.getByRole('dialog');
    await expect(dialog).toBeVisible();
    await stopClock(page);
    await dialog.getByRole('button', { name: 'STOP' }).click();
    await expect.poll(() => rig.sent('rig/stop').length).toBe(1);
    // While the stage moves Esc is STOP. While it stands Esc closes the dialog and is nothing else.
    rig.tell({ stage: { ...rig.state.stage, moving: true } });
    await expect(page.getByText('moves', { exact: true })).toBeAttached();
    await page.keyboard.press('Escape');
    await expect.poll(() => rig.sent('rig/stop').length).toBe(2);
    await expect(dialog).toHaveCount(0);
    rig.tell({ stage: { ...rig.state.stage, moving: false } });
    await expect(page.getByText('still', { exact: true })).toBeAttached();
    await page.getByRole('button', { name: 'Keys' }).click();
    await page.clock.runFor(100);
    await expect(dialog).toBeVisible();
    await page.keyboard.press('Escape');
    await expect(dialog).toHaveCount(0);
    await page.getByRole('spinbutton', { name: 'go to' }).focus();
    await page.keyboard.press('Escape');
    await expect.poll(() => rig.sent('rig/stop').length).toBe(3);
  });

  test('is shown pressed until the stage is still', async ({ page }) => {
    const rig = await opened(page);
    rig.tell({ stopping: true });
    await expect(stopButton(page)).toHaveAttribute('aria-pressed', 'true');
    await expect(page.getByRole('button', { name: 'Move +0.1 mm' })).toBeDisabled();
    rig.tell({ stopping: false });
    await expect(stopButton(page)).toHaveAttribute('aria-pressed', 'false');
  });

  test('that does not arrive is said, and is sent again', async ({ page }) => {
    const rig = await opened(page);
    await expect(live(page)).toBeVisible();
    await stopClock(page);
    rig.unreachable = true;
    await stopButton(page).click();
    await expect(page.getByRole('alert')).toContainText('STOP has not reached the rig');
    rig.unreachable = false;
    expect(rig.sent('rig/stop').length).toBe(0);
    await page.clock.runFor(400);
    await expect.poll(() => rig.sent('rig/stop').length).toBe(1);
    await expect(page.getByRole('alert')).toHaveCount(0);
  });
});

test.describe('live picture', () => {
  test('single pixels have their greys, and only what is seen is asked for', async ({ page }) => {
    const rig = await opened(page);
    await page.getByRole('button', { name: 'saturated' }).click();
    await expect.poll(() => rig.wishes.length).toBeGreaterThan(0);
    expect(rig.wishes.at(-1)).toMatchObject({ x: 0, y: 0, width: FRAME.columns, height: FRAME.rows });
    const box = await placeOf(page);
    await page.mouse.move(box.x + 100, box.y + 100);
    for (let step = 0; step < 24; step += 1) await page.mouse.wheel(0, -120);
    await expect.poll(() => rig.wishes.at(-1)!.width).toBeLessThan(30);
    // The wheel may still turn, and the picture that was wished comes later.
    await expect(async () => {
      const wish = rig.wishes.at(-1)!;
      expect(wish.pixels).toBeLessThanOrEqual(wish.width * wish.height);
      // The pane shows whole pixels as squares: each run along a line of the screen is one pixel.
      const [x, y, width] = [box.x + 5, box.y + 100, box.width - 90].map(Math.round);
      const seen: number[] = [];
      for (const [grey] of await coloursOf(page, { x: x!, y: y!, width: width!, height: 1 })) {
        if (seen.at(-1) !== grey) seen.push(grey!);
      }
      const rows = Array.from({ length: wish.height }, (_, row) =>
        Array.from({ length: wish.width }, (_, column) => greyAt(wish.x + column, wish.y + row)).join(),
      );
      const inner = seen.slice(1, -1);
      expect(inner.length).toBeGreaterThan(5);
      expect(rows.some((row) => `,${row},`.includes(`,${inner.join()},`))).toBe(true);
    }).toPass();
  });

  test('saturated pixels are striped black and white, and Z takes that away', async ({ page }) => {
    await opened(page);
    const box = await placeOf(page);
    const zoom = Math.min(box.width / FRAME.columns, box.height / FRAME.rows);
    const x = box.x + box.width / 2 + (310 - FRAME.columns / 2) * zoom;
    const y = box.y + box.height / 2 + (210 - FRAME.rows / 2) * zoom;
    const part = { x: Math.round(x) - 4, y: Math.round(y) - 4, width: 8, height: 8 };
    await expect.poll(() => coloursIn(page, part)).toEqual(['0,0,0', '255,255,255']);
    await page.keyboard.press('z');
    await expect.poll(() => coloursIn(page, part)).toEqual(['255,255,255']);
  });

  test('double click shows single pixels on single pixels, and again all', async ({ page }) => {
    const rig = await opened(page);
    const box = await placeOf(page);
    for (let step = 0; step < 5; step += 1) await page.keyboard.press('+');
    await expect.poll(() => rig.wishes.at(-1)!.width).toBeLessThan(300);
    // On a slow machine two clicks may be far apart; the page tells them by its clock.
    await stopClock(page);
    await page.mouse.dblclick(box.x + 200, box.y + 200);
    await page.clock.resume();
    await expect
      .poll(() => rig.wishes.at(-1)!.width)
      .toBeGreaterThanOrEqual(Math.min(FRAME.columns, Math.floor(box.width)) - 250);
    await page.keyboard.press('0');
    await expect.poll(() => rig.wishes.at(-1)!.width).toBe(FRAME.columns);
  });

  test('an old picture is veiled, and its numbers are dimmed', async ({ page }) => {
    const rig = await opened(page);
    await expect(page.locator('.bar-rate')).toContainText('ms old');
    rig.frozen = true;
    await expect(page.locator('.bar-rate')).toHaveClass(/amber/);
    await expect(page.getByRole('status', { name: 'Picture' })).toContainText(/\d s old/);
    await expect(page.locator('.focus')).toHaveClass(/dimmed/);
    rig.frozen = false;
    await expect(page.getByRole('status', { name: 'Picture' })).toHaveCount(0);
  });

  test('no pictures come to a hidden page or another view', async ({ page }) => {
    const rig = await opened(page);
    await expect.poll(() => rig.openPictures).toBe(1);
    await hide(page, true);
    await expect.poll(() => rig.openPictures).toBe(0);
    await hide(page, false);
    await expect.poll(() => rig.openPictures).toBe(1);
    await page.keyboard.press('2');
    await expect.poll(() => rig.openPictures).toBe(0);
  });
});

async function hide(page: Page, hidden: boolean): Promise<void> {
  await page.evaluate((now) => {
    Object.defineProperty(document, 'visibilityState', {
      value: now ? 'hidden' : 'visible',
      configurable: true,
    });
    document.dispatchEvent(new Event('visibilitychange'));
  }, hidden);
}

test.describe('states', () => {
  test('without a token everything is shown, and what would be refused is not', async ({ page }) => {
    await opened(page, { token: false });
    await expect(page.locator('.who')).toHaveText(/watching: this page can only look and stop$/);
    for (const name of ['Move +0.1 mm', 'Hold to move right', 'Home (hold)', 'Go', 'Run short']) {
      await expect(page.getByRole('button', { name, exact: true })).toHaveCount(0);
    }
    await expect(page.getByRole('spinbutton', { name: /^Exposure/ })).toHaveCount(0);
    await expect(page.getByText('Exposure: 8 ms')).toBeVisible();
    await expect(page.getByRole('button', { name: 'Take control' })).toHaveCount(0);
  });

  test('another page has control until it is taken', async ({ page }) => {
    const rig = new FakeRig(page);
    rig.state.controller = 'someone';
    await rig.open();
    const step = page.getByRole('button', { name: 'Move -0.1 mm' });
    await expect(step).toBeDisabled();
    await page.getByRole('button', { name: 'Take control' }).click();
    await expect(page.locator('.who')).toContainText('you control');
    await step.click();
    await expect.poll(() => rig.sent('rig/step')[0]?.asked.mm).toBe(-0.1);
  });

  test('not homed: amber, no number, no motion but Home, by a hold', async ({ page }) => {
    const rig = new FakeRig(page);
    rig.state.stage = { ...rig.state.stage, homed: false, position_mm: null };
    await rig.open();
    await expect(page.locator('.banner')).toContainText('Not homed');
    await expect(page.getByTestId('position')).toHaveText('\u2013');
    await expect(page.getByRole('button', { name: 'Go', exact: true })).toBeDisabled();
    await expect(page.getByRole('button', { name: 'Hold to move left' })).toBeDisabled();
    const home = page.getByRole('button', { name: 'Home (hold)' });
    // It is held for a second of the page's clock.
    await stopClock(page);
    await home.click();
    await home.focus();
    await page.keyboard.press('Enter');
    await page.clock.runFor(2000);
    await rig.heard();
    expect(rig.sent('rig/home').length).toBe(0);
    await page.keyboard.down('Enter');
    await page.clock.runFor(900);
    await rig.heard();
    expect(rig.sent('rig/home').length).toBe(0);
    await page.clock.runFor(200);
    await expect.poll(() => rig.sent('rig/home').length).toBe(1);
    await page.keyboard.up('Enter');
    await home.hover();
    await page.mouse.down();
    await page.clock.runFor(1100);
    await expect.poll(() => rig.sent('rig/home').length).toBe(2);
    await page.mouse.up();
  });

  test('a task turns orders off and is told with its progress', async ({ page }) => {
    const rig = await opened(page);
    rig.tell({
      task: {
        kind: 'doctor',
        words: 'doctor: whole run',
        step: 'noise',
        done: 3,
        of: 10,
        seconds_left: 52,
        stops: false,
      },
    });
    await expect(page.getByRole('progressbar', { name: 'Doctor' })).toHaveAttribute('aria-valuenow', '30');
    await expect(page.getByText('Doctor: runs')).toBeVisible();
    await expect(page.getByRole('list', { name: 'Checks' })).toHaveCount(0);
    await expect(page.locator('.job')).toContainText('doctor: whole run noise · 3 of 10 · about 50 s left');
    const step = page.getByRole('button', { name: 'Move +1 mm' });
    await expect(step).toBeDisabled();
    await expect(step).toHaveAttribute('title', 'Off: doctor: whole run');
    rig.tell({ task: null });
    await expect(step).toBeEnabled();
  });

  test('a lost camera and a lost stage are told, with a way back', async ({ page }) => {
    const rig = await opened(page);
    await expect(page.locator('.veil')).toHaveCount(0);
    rig.tell({ camera: { ...rig.state.camera, state: 'lost', error: 'unplugged' } });
    await expect(page.getByRole('alert')).toContainText('The camera is lost: unplugged.');
    await expect(page.locator('.veil')).toContainText('camera lost');
    await page.getByRole('button', { name: 'Reconnect' }).click();
    await expect.poll(() => rig.sent('rig/reconnect').length).toBe(1);
    rig.tell({
      camera: { ...rig.state.camera, state: 'live' },
      stage: { ...rig.state.stage, state: 'lost', error: null },
    });
    await expect(page.getByRole('alert')).toContainText('The stage is lost.');
    await expect(page.getByRole('button', { name: 'Hold to move left' })).toBeDisabled();
  });

  test('a server that is gone is said, all moves are off, and it comes back', async ({ page }) => {
    const rig = await opened(page);
    await expect(page.getByRole('button', { name: 'Move +1 mm' })).toBeEnabled();
    await rig.vanish();
    await expect(page.getByRole('alert')).toContainText('Server gone: no contact');
    await expect(page.getByRole('button', { name: 'Move +1 mm' })).toBeDisabled();
    rig.unreachable = false;
    await expect(page.getByRole('alert')).toHaveCount(0);
    await expect(page.getByRole('button', { name: 'Move +1 mm' })).toBeEnabled();
  });

  test('a disk that fills up is said with what is needed', async ({ page }) => {
    const rig = await opened(page);
    const scan = {
      name: 'set-1',
      folder: '/data/set-1',
      state: 'running' as const,
      held_by: [],
      reason: null,
      planned: 101,
      done: 37,
      retakes: [],
      stops: [],
      asked: null,
      seconds_left: 200,
      needs_bytes: 3.1e9,
      free_bytes: 4e9,
      map: null,
      course: [],
      measured: false,
    };
    rig.tell({ scan });
    await expect(page.locator('.banner.warn')).toContainText('needs 3.1 GB more, 4.0 GB are free');
    rig.tell({ scan: { ...scan, free_bytes: 2e9 } });
    await expect(page.getByRole('alert')).toContainText('too full');
    rig.tell({ scan: { ...scan, free_bytes: 4e11, state: 'paused', held_by: ['operator', 'disk'] } });
    await expect(page.locator('.banner.blue')).toContainText('held by: operator, disk');
  });
});

test.describe('controls', () => {
  test('a number, a menu, a box and a button set what they name', async ({ page }) => {
    const rig = await opened(page);
    await page.getByRole('button', { name: 'More: Exposure' }).click();
    await expect
      .poll(() => rig.sent('rig/control').at(-1)?.asked)
      .toMatchObject({
        name: 'exposure_time_absolute',
        value: '81',
      });
    await expect(page.getByRole('spinbutton', { name: /^Exposure/ })).toHaveValue('8.1');
    // What is beyond the range is not set in silence.
    await page.getByRole('spinbutton', { name: 'Exposure in ms' }).fill('40');
    await page.keyboard.press('Enter');
    await expect(page.getByText('Exposure goes from 0.1 ms to 20 ms')).toBeVisible();
    await expect.poll(() => rig.sent('rig/control').at(-1)?.asked).toMatchObject({ value: '200' });
    await page.getByRole('combobox', { name: 'Auto exposure' }).selectOption('3');
    await expect.poll(() => rig.sent('rig/control').at(-1)?.asked).toMatchObject({ value: '3' });
    // The answer to the menu may still come, and tells of a box that is not set.
    await page.getByRole('checkbox', { name: 'Flip' }).click();
    await expect
      .poll(() => rig.sent('rig/control').at(-1)?.asked)
      .toMatchObject({ name: 'flip', value: '1' });
    await expect(page.getByRole('checkbox', { name: 'Flip' })).toBeChecked();
    await page.getByRole('button', { name: 'Save as default' }).click();
    await expect.poll(() => rig.sent('rig/control').at(-1)?.asked.name).toBe('save_as_default');
    await expect(page.getByRole('spinbutton', { name: 'Gamma' })).toBeDisabled();
  });

  test('letters and digits do nothing in inputs', async ({ page }) => {
    const rig = await opened(page);
    await page.getByRole('spinbutton', { name: 'go to' }).fill('40');
    await page.keyboard.type('3tz');
    await expect(live(page)).toBeVisible();
    await rig.heard();
    expect(rig.sent('rig/target').length).toBe(0);
    await expect(page.getByRole('button', { name: 'saturated' })).toHaveAttribute('aria-pressed', 'true');
  });

  test('going to a position, targets, doctor and what a simulated camera sees', async ({ page }) => {
    const rig = await opened(page);
    await page.getByRole('spinbutton', { name: 'go to' }).fill('40');
    await page.getByRole('button', { name: 'Go', exact: true }).click();
    await expect.poll(() => rig.sent('rig/go')[0]?.asked.mm).toBe(40);
    // Enter goes, too, and only once; not beyond the travel.
    await page.getByRole('spinbutton', { name: 'go to' }).fill('41.5');
    await page.keyboard.press('Enter');
    await expect.poll(() => rig.sent('rig/go')[1]?.asked.mm).toBe(41.5);
    await page.getByRole('spinbutton', { name: 'go to' }).fill('4000');
    await page.keyboard.press('Enter');
    await expect(page.getByRole('alert')).toContainText('the stage goes from 0 to 100 mm');
    await rig.heard();
    // What is no number is not the number before.
    await page.getByRole('spinbutton', { name: 'go to' }).fill('50');
    await page.keyboard.press('Enter');
    await expect.poll(() => rig.sent('rig/go')[2]?.asked.mm).toBe(50);
    for (const typed of ['1O0', '41,5x', '']) {
      await page.getByRole('spinbutton', { name: 'go to' }).fill(typed);
      await page.keyboard.press('Enter');
      await expect(page.getByRole('alert')).toContainText(`"${typed}" is not a number`);
      await expect(page.getByRole('spinbutton', { name: 'go to' })).toHaveValue(typed);
    }
    await page.getByRole('spinbutton', { name: 'go to' }).fill('51');
    await page.keyboard.down('Enter');
    await page.keyboard.down('Enter');
    await page.keyboard.up('Enter');
    await rig.heard();
    expect(rig.sent('rig/go').map(({ asked }) => asked.mm)).toEqual([40, 41.5, 50, 51]);
    await page.getByRole('button', { name: 'Go', exact: true }).focus();
    await page.keyboard.press('t');
    await expect.poll(() => rig.sent('rig/target')[0]?.asked.on).toBe(true);
    await page.getByRole('button', { name: 'Run short' }).click();
    await expect.poll(() => rig.sent('rig/doctor')[0]?.asked.short).toBe(true);
    await page.getByRole('button', { name: 'cap', exact: true }).click();
    await expect.poll(() => rig.sent('rig/show')[0]?.asked).toMatchObject({ what: 'dark', pose: 0 });
    await page.getByRole('button', { name: 'reset peak' }).click();
    await expect.poll(() => rig.sent('rig/reset-peak').length).toBe(1);
  });
});
