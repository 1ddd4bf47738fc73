import { expect, test } from '@playwright/test';
import { readFile } from 'node:fs/promises';
import { measured, plainly } from '../../src/format/number';
import { lengthUnit } from '../../src/format/lengths';
import { codeAt, disparityAt, frameAt, heightAt, REFERENCE, sigmaMmAt, sigmaPxAt } from '../mock/truth';
import {
  centre,
  foundPixel,
  mapOf,
  open,
  pixelOf,
  REAL,
  resultsOf,
  SECRET,
  showPanel,
  text,
  valueOf,
} from './page';
import { stopClock } from './clock';
import { quiet } from './quiet';

test('a click pins exactly the pixel under the pointer and shows its value', async ({ page }) => {
  await open(page);
  const at = await foundPixel(page);
  const { maps } = await resultsOf(page);
  await open(page, `results/${maps[0]!.id}?v=${at.x + 0.5},${at.y + 0.5},16&p=${at.x + 1},${at.y}`);
  const middle = await centre(page);
  // Close to each corner of the zoomed pixel.
  for (const [dx, dy] of [
    [-7, -7],
    [7, -7],
    [-7, 7],
    [7, 7],
  ] as const) {
    // The pin is elsewhere before, so that each click has to bring it.
    await expect(valueOf(page)).toContainText(`(${at.x + 1}, ${at.y})`);
    await page.mouse.click(middle.x + dx, middle.y + dy);
    await expect(valueOf(page)).toContainText(`(${at.x}, ${at.y})`);
    await page.keyboard.press('ArrowRight');
  }
  await page.keyboard.press('ArrowLeft');
  const reply = await pixelOf(page, at.x, at.y);
  const first = reply.values[0]!;
  const height = maps.find(({ id }) => id === 'height');
  const unit =
    first.unit === 'mm' ? lengthUnit(height!.low, height!.high) : { label: first.unit, factor: 1 };
  const sigma = first.sigma === null ? null : first.sigma * unit.factor;
  await expect(valueOf(page)).toContainText(measured(first.value! * unit.factor, sigma, unit.label));
});

test('disparity and sigma of a pixel of known truth', async ({ page }) => {
  test.skip(!!REAL, 'the truth is that of the mock server');
  await open(page, 'results/height?p=452,150');
  const panel = page.getByRole('tabpanel');
  await expect(panel).toContainText('At (452, 150)');
  await expect(panel).toContainText('= 11.300, 3.750 mm');
  await expect(panel).toContainText(measured(heightAt(452, 150), sigmaMmAt(452, 150), 'mm'));
  await expect(panel).toContainText(measured(20 + 6 * heightAt(452, 150), 6 * sigmaMmAt(452, 150), 'px'));
  await expect(panel).toContainText('sigma here is better than 78 % of the map');
});

test('a pixel without a value says why', async ({ page }) => {
  test.skip(!!REAL, 'the truth is that of the mock server');
  expect(codeAt(520, 380)).toBe(3);
  await open(page, 'results/height?p=520,380');
  await expect(valueOf(page)).toContainText('no value: too uncertain');
});

test('the pin moves with the keyboard', async ({ page }) => {
  await open(page);
  const at = await foundPixel(page);
  await open(page, `results/${(await resultsOf(page)).maps[0]!.id}?p=${at.x},${at.y}`);
  await mapOf(page).focus();
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('Shift+ArrowDown');
  await expect(valueOf(page)).toContainText(`(${at.x + 1}, ${at.y + 10})`);
  await page.keyboard.press('m');
  await expect(page.getByLabel('Map', { exact: true })).toHaveValue((await resultsOf(page)).maps[1]!.id);
});

test('letters do nothing while a person types', async ({ page }) => {
  await open(page);
  const first = (await resultsOf(page)).maps[0]!.id;
  await page.getByRole('spinbutton', { name: 'Upper end' }).focus();
  await page.keyboard.press('m');
  await expect(page.getByLabel('Map', { exact: true })).toHaveValue(first);
});

test('a line shows its profile, and its CSV is that of the server', async ({ page }) => {
  await open(page);
  const middle = await centre(page);
  await page.keyboard.down('Shift');
  await page.mouse.move(middle.x - 120, middle.y);
  await page.mouse.down();
  await page.mouse.move(middle.x, middle.y + 10, { steps: 4 });
  await page.mouse.move(middle.x + 100, middle.y + 20, { steps: 4 });
  await page.mouse.up();
  await page.keyboard.up('Shift');
  const curve = page.getByRole('img', { name: /^Profile from A to B/ });
  await expect(curve).toBeVisible();
  const profile = page.getByRole('region', { name: 'Profile' });
  await profile.getByRole('button', { name: 'Cursors' }).click();
  const cursors = profile.getByRole('group', { name: 'Cursors' });
  await expect(cursors).toContainText(/dx \d.* mm; dz .*sigma .*; slope .*°|no height/);
  const second = cursors.getByRole('spinbutton', { name: 'cursor 2 in mm' });
  const before = await second.inputValue();
  const { width: across, height: high } = (await curve.boundingBox())!;
  await curve.click({ position: { x: 0.95 * across, y: high / 2 } });
  await expect.poll(async () => Number(await second.inputValue())).toBeGreaterThan(Number(before));
  await cursors.getByRole('button', { name: 'Clear cursors' }).click();
  const words = await profile.getByRole('heading').innerText();
  const ends = [...words.matchAll(/\d+/g)].slice(0, 4).map(([digits]) => digits);
  ends.push(await profile.getByRole('spinbutton', { name: 'width in px' }).inputValue());
  // The address is written a moment later.
  await expect.poll(() => page.url()).toContain(`l=${ends.join(',')}`);
  const [saved] = await Promise.all([
    page.waitForEvent('download'),
    page.getByRole('button', { name: 'CSV' }).click(),
  ]);
  const [x0, y0, x1, y1, width] = ends;
  const wanted = await text(page, `line.csv?x0=${x0}&y0=${y0}&x1=${x1}&y1=${y1}&width=${width}`);
  expect(await readFile(await saved.path(), 'utf8')).toBe(wanted);
  expect(wanted.split('\n').length).toBeGreaterThan(10);
});

test('a region asks for steps and roughness', async ({ page }) => {
  test.skip((await (async () => (await open(page), resultsOf(page)))()).geometry === null, 'needs heights');
  await page.getByRole('button', { name: 'Draw region' }).first().click();
  const middle = await centre(page);
  await page.mouse.move(middle.x - 120, middle.y - 80);
  await page.mouse.down();
  await page.mouse.move(middle.x + 100, middle.y + 70, { steps: 4 });
  await page.mouse.up();
  const panel = page.getByRole('tabpanel');
  await expect(panel).toContainText('About the least-squares plane of the region');
  await showPanel(page, 'Steps');
  await expect(panel).toContainText('Steps and roughness of the region');
  await expect(panel).toContainText('Sq');
  await expect(panel).toContainText(/± holds 95 % coverage|No step height/);
});

test('the range can be set by keys, by numbers and back', async ({ page }) => {
  await open(page);
  const upper = page.getByRole('slider', { name: 'Upper end of the range' });
  const now = async (): Promise<number> => Number(await upper.getAttribute('aria-valuenow'));
  const before = await now();
  await upper.focus();
  await page.keyboard.press('PageDown');
  await expect(page.getByLabel('Range', { exact: true })).toHaveValue('hand');
  await expect.poll(now).toBeLessThan(before);
  await expect(page.locator('.beyond').first()).toContainText(/over \d/);
  await page.getByLabel('Range', { exact: true }).selectOption('auto');
  await expect.poll(now).toBeCloseTo(before, 9);
});

test('the address restores the view and never holds the token', async ({ page, context }) => {
  await open(page);
  const at = await foundPixel(page);
  const { maps } = await resultsOf(page);
  const map = maps[1]!.id;
  await open(page, `results/${map}?p=${at.x},${at.y}&v=${at.x},${at.y},3&m=cividis`);
  expect(page.url()).not.toContain(SECRET);
  await expect(valueOf(page)).toContainText(`(${at.x}, ${at.y})`);
  const zoom = (): number => Number(/[?&]v=[^,]+,[^,]+,([^&]+)/.exec(page.url())?.[1]);
  expect(zoom()).toBe(3);
  await page.keyboard.press('+');
  // The page writes the view into the address a moment after it has changed.
  await expect.poll(zoom).toBeGreaterThan(3);
  const link = page.url();
  expect(link.length).toBeLessThan(300);

  await context.grantPermissions(['clipboard-read', 'clipboard-write']);
  await page.getByRole('button', { name: 'Copy link' }).click();
  await expect(page.getByRole('status', { name: 'Notice' })).toContainText('Link copied');
  expect(await page.evaluate(() => navigator.clipboard.readText())).toBe(link);

  // A reload of the tab still has the token, since results load.
  await page.goto('about:blank');
  await page.goto(link);
  await expect(page.getByLabel('Map', { exact: true })).toHaveValue(map);
  await expect(valueOf(page)).toContainText(`(${at.x}, ${at.y})`);
  expect(page.url()).toBe(link);
});

test('a lost server is said, and the page recovers by a button or by itself', async ({ page, context }) => {
  // The page asks for the server now and then; with its clock stopped it does so when the test says.
  await page.clock.install();
  await open(page);
  const { x, y } = await centre(page);
  await stopClock(page);
  const lost = page.getByRole('alert');
  for (const back of [
    () => page.getByRole('button', { name: 'Retry' }).click(),
    () => page.clock.fastForward(6000),
  ]) {
    await context.setOffline(true);
    await page.mouse.click(x, y);
    await page.clock.runFor(200);
    await expect(lost).toContainText('Server gone: no contact for');
    await context.setOffline(false);
    await back();
    await expect(lost).toHaveCount(0);
    // Where it is now, so that the next click asks again.
    await page.keyboard.press('ArrowRight');
    await page.clock.runFor(200);
    await expect(valueOf(page)).not.toContainText('…');
  }
});

test('no request leaves the server, and nothing is refused', async ({ page }) => {
  // Ten panels, each until it is complete, and the surface in 3-D.
  test.slow();
  const foreign: string[] = [];
  const faults: string[] = [];
  page.on('request', (request) => {
    if (!/^(blob:|data:)/.test(request.url()) && !request.url().startsWith(new URL(page.url()).origin)) {
      foreign.push(request.url());
    }
  });
  page.on('console', (message) => message.type() === 'error' && faults.push(message.text()));
  page.on('pageerror', (error) => faults.push(String(error)));
  await open(page);
  foreign.length = 0;
  const names = await page.getByRole('tab').allTextContents();
  for (const name of names) {
    await showPanel(page, name);
  }
  if ((await resultsOf(page)).geometry) {
    await page.getByRole('button', { name: '3-D' }).click();
    await quiet(page);
    await expect(page.getByText('loading…')).toHaveCount(0);
  }
  expect(foreign).toEqual([]);
  expect(faults).toEqual([]);
});

test('pin and pointer tell the value of what is shown, of that pixel, with its name', async ({ page }) => {
  test.skip(!!REAL, 'the truth is that of the mock server');
  // All of the map is on the screen: a pixel of the screen is the mean of some of the map.
  await open(page, 'results/height?v=all&p=452,150');
  const pointer = page.locator('.at-pointer');
  const look = async (): Promise<{ x: number; y: number }> => {
    const { x, y } = await centre(page);
    await page.mouse.move(x + 41, y - 33);
    await expect(pointer).not.toContainText('\u2026');
    const place = /\((\d+), (\d+)\)/.exec((await pointer.textContent())!)!;
    return { x: Number(place[1]), y: Number(place[2]) };
  };
  const texts: [map: string, name: string, text: (x: number, y: number) => string][] = [
    ['height', 'Height', (x, y) => measured(heightAt(x, y), sigmaMmAt(x, y), 'mm')],
    [
      'height-sigma',
      'Standard uncertainty of the height',
      (x, y) => `${plainly(Math.fround(sigmaMmAt(x, y)))} mm`,
    ],
    ['disparity', 'Disparity', (x, y) => measured(disparityAt(x, y), sigmaPxAt(x, y), 'px')],
    ['mask', 'Answers of the matcher', () => 'answered'],
  ];
  for (const [map, name, text] of texts) {
    await page.getByRole('combobox', { name: 'Map' }).selectOption(map);
    await expect(valueOf(page)).toContainText(`(452, 150)  ${text(452, 150)}`);
    await expect(valueOf(page)).toContainText(name);
    const { x, y } = await look();
    await expect(pointer).toHaveText(`pointer (${x}, ${y})  ${text(x, y)}`);
  }
  await page.getByRole('combobox', { name: 'Map' }).selectOption('frame');
  await expect(valueOf(page)).toContainText(`${plainly(frameAt(REFERENCE, 452, 150))} DN`);
  await expect(valueOf(page)).toContainText(`Frame ${REFERENCE}`);
  const { x, y } = await look();
  await expect(pointer).toContainText(`${plainly(frameAt(REFERENCE, x, y))} DN`);
});

test('a region is answered at once, whatever panel is open, and its drag asks once', async ({ page }) => {
  await open(page, 'results/height?s=pixel');
  const { x, y } = await centre(page);
  const asked: string[] = [];
  page.on('request', (request) => {
    if (/api\/(surface|line)\b/.test(request.url())) asked.push(request.url());
  });
  for (const key of ['Alt', 'Shift']) {
    await page.keyboard.down(key);
    await page.mouse.move(x - 60, y - 50);
    await page.mouse.down();
    for (let by = 0; by <= 20; by += 1) await page.mouse.move(x - 60 + 6 * by, y - 50 + 5 * by);
    await page.mouse.up();
    await page.keyboard.up(key);
    await quiet(page);
  }
  expect(asked.map((address) => /surface|line/.exec(address)![0])).toEqual(['surface', 'line']);
  const panel = page.getByRole('tabpanel', { name: 'Region' });
  await expect(panel).toContainText('in the region');
  await expect(panel.getByRole('button', { name: 'Clear' })).toBeVisible();
});

test('the answer stands over the map, and leads to its details', async ({ page }) => {
  await open(page);
  const { surface } = await resultsOf(page);
  const { depth, sentence, verdict, verdict_sentence } = surface!.conclusion;
  const answer = page.getByRole('region', { name: 'Answer' });
  for (const words of [verdict?.toUpperCase() ?? '', depth ?? '', verdict_sentence ?? sentence])
    await expect(answer).toContainText(words.replaceAll('+-', '±'));
  await answer.getByRole('button', { name: 'Details' }).click();
  await expect(page.getByRole('tabpanel', { name: 'Steps' })).toContainText(sentence.replace('+-', '±'));
});

test('the budget of the uncertainty is readable at any width', async ({ page }) => {
  for (const [width, height] of [
    [1280, 720],
    [1024, 768],
    [820, 1180],
    [390, 844],
  ] as const) {
    await page.setViewportSize({ width, height });
    await open(page, 'results/height?s=steps');
    const table = page.getByRole('region', { name: 'Uncertainty budget' });
    await expect(table).toBeVisible();
    const over = await table.evaluate((box) => box.scrollWidth - box.clientWidth);
    expect(over, `${width} px`).toBeLessThanOrEqual(0);
    const cells = await table.locator('td').evaluateAll((all) =>
      all.every((cell) => {
        const { left, right } = cell.getBoundingClientRect();
        return left >= 0 && right <= innerWidth && cell.scrollWidth <= cell.clientWidth;
      }),
    );
    expect(cells, `${width} px`).toBe(true);
  }
});

test('the map starts with what has answers, and shows all when asked', async ({ page }) => {
  test.skip(!!REAL, 'the truth is that of the mock server');
  await page.route('**/api/results', async (route) => {
    const reply = await route.fetch();
    await route.fulfill({ json: { ...(await reply.json()), answered_px: [300, 200, 400, 280] } });
  });
  await open(page);
  const at = async (): Promise<number[]> => {
    const { x, y } = await centre(page);
    await page.mouse.move(x, y);
    const place = /\((\d+), (\d+)\)/.exec((await page.locator('.at-pointer').textContent())!)!;
    return [Number(place[1]), Number(place[2])];
  };
  const near = async (x: number, y: number): Promise<void> => {
    await expect
      .poll(async () => {
        const found = await at();
        return Math.hypot(found[0]! - x, found[1]! - y);
      })
      .toBeLessThan(2);
  };
  await near(350, 240);
  await page.getByRole('button', { name: 'Show all' }).click();
  await near(320, 240);
  await expect.poll(() => page.url()).toContain('v=all');
});

test('results that have changed are loaded anew, and none of the former is shown beside them', async ({
  page,
}) => {
  test.skip(!!REAL, 'the mock server has one match');
  await open(page, 'results/height?p=300,240');
  await expect(valueOf(page)).toContainText('mm');
  const tiles: string[] = [];
  // Another match takes the place of the one on the page.
  await page.route(/\/api\//, async (route) => {
    const address = new URL(route.request().url());
    if (address.searchParams.get('of') === 'mock') {
      await route.fulfill({ status: 409, json: { error: { message: 'these are other results' } } });
    } else if (/api\/(about|results)$/.test(address.pathname)) {
      const known = (await (await route.fetch()).json()) as object;
      const change = address.pathname.endsWith('about') ? { results: 'other' } : { id: 'other' };
      await route.fulfill({ json: { ...known, ...change } });
    } else {
      if (/maps\//.test(address.pathname)) tiles.push(address.searchParams.get('of')!);
      await route.continue();
    }
  });
  await page.locator('#map').press('ArrowRight');
  await expect(page.getByRole('status', { name: 'Notice' })).toContainText('results have changed');
  await expect(valueOf(page)).toContainText('(301, 240)');
  await expect(valueOf(page)).toContainText('mm');
  await quiet(page);
  expect(tiles.length).toBeGreaterThan(0);
  expect(new Set(tiles)).toEqual(new Set(['other']));
  await page.unrouteAll({ behavior: 'ignoreErrors' });
});

test('changed results that cannot be loaded are not told to be there, and are tried once', async ({
  page,
}) => {
  test.skip(!!REAL, 'the mock server has one match');
  await open(page, 'results/height?p=300,240');
  let [looks, loads] = [0, 0];
  await page.route(/\/api\/(about|results)$/, async (route) => {
    if (route.request().url().endsWith('results')) {
      loads += 1;
      await route.fulfill({ status: 500, json: { error: { message: 'match.json is damaged' } } });
      return;
    }
    looks += 1;
    const known = (await (await route.fetch()).json()) as object;
    await route.fulfill({ json: { ...known, results: 'other' } });
  });
  // The first look finds them, loading asks once more who is there, and the second look lets them be.
  await expect.poll(() => looks).toBeGreaterThanOrEqual(3);
  await quiet(page);
  await expect(page.getByRole('alert')).toContainText('match.json is damaged');
  await expect(page.getByText('these are the new ones')).toHaveCount(0);
  expect(loads).toBe(1);
  await page.unrouteAll({ behavior: 'ignoreErrors' });
  await page.getByRole('button', { name: 'Retry' }).click();
  await expect(page.getByText('match.json is damaged')).toHaveCount(0);
});

test('a surface that cannot be shown is told, and the match is shown without it', async ({ page }) => {
  test.skip(!!REAL, 'the mock server has a good surface');
  await page.route(/\/api\/results$/, async (route) => {
    const known = (await (await route.fetch()).json()) as object;
    await route.fulfill({ json: { ...known, surface: null, unfit: 'the surface is not shown: damaged' } });
  });
  await open(page, 'results/height?p=300,240');
  await expect(page.getByText('the surface is not shown: damaged')).toBeVisible();
  await expect(valueOf(page)).toContainText('mm');
});

test('frames are shown in the map, and the map comes back', async ({ page }) => {
  await open(page);
  await page.getByRole('tab', { name: 'Frames' }).click();
  await page.getByRole('button', { name: 'Next frame' }).click();
  await expect(page.getByRole('img', { name: /^Frame \d+/ })).toBeVisible();
  await page.getByRole('button', { name: 'Play' }).click();
  const frame = page.getByRole('slider', { name: 'Frame', exact: true });
  const before = await frame.inputValue();
  await expect.poll(() => frame.inputValue()).not.toBe(before);
  await page.getByRole('button', { name: 'Pause' }).click();
  await page.getByRole('button', { name: 'Back to the map' }).click();
  await expect(page.getByRole('img', { name: /^Frame \d+/ })).toHaveCount(0);
});

test('the difference to other results is a map and numbers', async ({ page }) => {
  await open(page);
  const { others } = await resultsOf(page);
  test.skip(others.length === 0, 'there are no other results');
  await page.getByRole('tab', { name: 'Compare' }).click();
  await page.getByRole('tabpanel').getByRole('combobox').selectOption(others[0]!);
  await page.getByRole('button', { name: 'Show difference', exact: true }).click();
  await expect(page.getByRole('img', { name: /^Difference of/ })).toBeVisible();
  await expect(page.getByRole('tabpanel')).toContainText('standard deviation');
});

test.describe('touch', () => {
  test.use({ hasTouch: true, viewport: { width: 390, height: 844 } });

  test('a tap sets the pin', async ({ page }) => {
    await open(page);
    const { x, y } = await centre(page);
    await page.touchscreen.tap(x, y);
    await expect(valueOf(page)).toContainText(/^\(\d+, \d+\)/);
  });
});

test('the report opens in a tab of its own', async ({ page }) => {
  await page.route('**/api/download/surface/report.html*', (route) =>
    route.fulfill({ body: '<h1>Report of a tile</h1>', contentType: 'application/octet-stream' }),
  );
  await open(page);
  const [tab] = await Promise.all([
    page.waitForEvent('popup'),
    page.getByRole('button', { name: 'Report' }).click(),
  ]);
  await expect(tab.getByRole('heading', { name: 'Report of a tile' })).toBeVisible();
  await page.unrouteAll({ behavior: 'ignoreErrors' });
});
