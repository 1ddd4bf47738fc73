// The bar and STOP stay where they are, whatever is told; and what a page that only watches can do.

import { expect, test, type Page } from '@playwright/test';
import type { RigState } from '../../src/rig/api';
import { FakeRig, startState } from './fake_rig';
import { REAL } from './page';
import { drawn } from './quiet';

test.skip(!!REAL, 'the fake rig needs the mock server');

const SIZES = [
  [1280, 720],
  [1024, 768],
  [820, 1180],
  [390, 844],
] as const;

const LONG =
  'the profile describes no chess-board: set square, columns and rows in its section board, or in target; ' +
  'as long as it has none, nothing can be found in the picture, however bright and sharp it is';

const start = startState();

/** States in which the bar has much to tell. */
const TOLD: [words: string, change: Partial<RigState>][] = [
  ['at rest', {}],
  ['another page has control', { controller: 'another' }],
  ['a long name', { rig: `/home/somebody/measurements/2026/${'bench-with-a-long-name-'.repeat(4)}.toml` }],
  ['moving', { stage: { ...start.stage, moving: true, position_mm: -123.4567 } }],
  ['not homed', { stage: { ...start.stage, homed: false, position_mm: null } }],
  ['camera lost', { camera: { ...start.camera, state: 'lost', error: LONG } }],
  ['stage lost', { stage: { ...start.stage, state: 'lost', error: LONG, position_mm: null } }],
  ['stopping', { stopping: true }],
];

interface Box {
  x: number;
  y: number;
  width: number;
  height: number;
}

interface Places {
  bar: Box;
  stop: Box;
}

/** Where bar and STOP are, and whether a press anywhere on STOP reaches it. */
async function places(page: Page): Promise<Places> {
  await drawn(page);
  return page.evaluate(() => {
    const box = (name: string): DOMRect => document.querySelector(name)!.getBoundingClientRect();
    const [bar, stop] = [box('.bar'), box('.bar button.stop')];
    for (const [across, down] of [
      [0.02, 0.1],
      [0.5, 0.5],
      [0.98, 0.9],
      [0.98, 0.1],
      [0.02, 0.9],
    ] as const) {
      const found = document.elementFromPoint(stop.x + across * stop.width, stop.y + down * stop.height);
      if (!found?.closest('button.stop')) throw new Error(`STOP is covered by ${found?.outerHTML}`);
    }
    const inside =
      stop.left >= 0 && stop.top >= 0 && stop.right <= innerWidth && stop.bottom <= innerHeight;
    if (!inside) throw new Error('STOP is not on the screen');
    const plain = ({ x, y, width, height }: DOMRect): Box => ({ x, y, width, height });
    return { bar: plain(bar), stop: plain(stop) };
  });
}

for (const [width, height] of SIZES) {
  test(`bar and STOP stay where they are at ${width} px`, async ({ page }) => {
    await page.setViewportSize({ width, height });
    const rig = new FakeRig(page);
    await rig.open();
    await rig.shown();
    const first = await places(page);
    expect(first.stop.height).toBeGreaterThanOrEqual(48);
    const same = async (words: string): Promise<void> => expect(await places(page), words).toEqual(first);
    for (const [view, key] of [
      ['rig', '1'],
      ['scan', '2'],
      ['results', '3'],
      ['sequences', '4'],
    ]) {
      await page.keyboard.press(key!);
      for (const [words, change] of TOLD) {
        rig.tell({ ...start, ...change });
        await rig.shown();
        await same(`${view}, ${words}`);
      }
      rig.tell(start);
      await rig.shown();
    }
    // The longest refusal there is, beside its button, and without one.
    await page.keyboard.press('1');
    rig.refusal = LONG;
    await page.getByRole('button', { name: 'Move +1 mm' }).click();
    await expect(page.getByRole('alert')).toContainText(LONG);
    await same('a refusal');
    await page.keyboard.press('t');
    await expect(page.getByRole('alert')).toContainText(LONG);
    await same('a refusal of a key');
    rig.refusal = null;
    await page.keyboard.press('Shift');
    await expect(page.getByRole('alert')).toHaveCount(0);
    await same('after a refusal');
    await page.keyboard.press('3');
    await page.evaluate(() => navigator.clipboard.writeText('').catch(() => undefined));
    await page.context().grantPermissions(['clipboard-write']);
    await page.keyboard.press('c');
    await expect(page.getByRole('status', { name: 'Notice' })).toContainText('Link copied');
    await same('a notice');
  });

  test(`a refusal stands at its field, and is not green, at ${width} px`, async ({ page }) => {
    await page.setViewportSize({ width, height });
    const rig = new FakeRig(page);
    await rig.open();
    const field = page.getByRole('spinbutton', { name: 'Exposure in ms' });
    await field.scrollIntoViewIfNeeded();
    await field.fill('1000');
    await page.keyboard.press('Enter');
    const alert = page.getByRole('alert');
    await expect(alert).toHaveText(/Exposure goes from 0.1 ms to 20 ms/);
    const [at, words] = [(await field.boundingBox())!, (await alert.boundingBox())!];
    const apart = Math.max(at.y - words.y - words.height, words.y - at.y - at.height);
    expect(apart).toBeLessThan(12);
    expect(apart).toBeGreaterThanOrEqual(0);
    const colours = await alert.evaluate((element) => {
      const paint = (name: string): string => {
        element.style.color = `var(--${name})`;
        const shown = getComputedStyle(element).color;
        element.style.color = '';
        return shown;
      };
      return { shown: getComputedStyle(element).color, error: paint('error'), ok: paint('ok') };
    });
    expect(colours.shown).toBe(colours.error);
    expect(colours.shown).not.toBe(colours.ok);
  });

  test(`a page that watches has a STOP that stops, and nothing that is refused, at ${width} px`, async ({
    page,
  }) => {
    await page.setViewportSize({ width, height });
    const rig = new FakeRig(page, { token: false });
    await rig.open();
    await expect(page.locator('.who')).toContainText('watching');
    await places(page);
    await page.locator('.bar').getByRole('button', { name: 'STOP' }).click();
    await expect.poll(() => rig.sent('rig/stop').length).toBe(1);
    await expect(page.locator('.notice.refused')).toHaveCount(0);
    await page.keyboard.press('Escape');
    await expect.poll(() => rig.sent('rig/stop').length).toBe(2);
    // Whatever else can be pressed or typed in gives no order.
    for (const key of ['1', '2', '3']) {
      await page.keyboard.press(key);
      await rig.shown();
      const names = await page
        .locator('main button, main input, main select')
        .evaluateAll((all) =>
          all
            .filter((one) => !(one as HTMLButtonElement).disabled && one.checkVisibility())
            .map((one) => one.getAttribute('aria-label') || one.textContent || one.tagName),
        );
      const orders =
        /home|move|^go|run |reset|find|start|resume|measure|pause|use now|save to|exposure|gain/i;
      expect(names.filter((name) => orders.test(name ?? ''))).toEqual([]);
    }
    expect(rig.orders.filter(({ path }) => path !== 'rig/stop')).toEqual([]);
    expect(rig.refused.filter((path) => path !== 'rig/hello')).toEqual([]);
  });
}
