// What the tests share: the link, the truth, and where pixels are on the screen.

import { type APIResponse, expect, type Locator, type Page } from '@playwright/test';
import { TOKEN } from '../mock/server';
import type { PixelInfo, Results } from '../../src/api';
import { quiet, watchRequests } from './quiet';

export const REAL = process.env.EPIRIG_URL;
const LINK = new URL(REAL ?? `http://127.0.0.1:${process.env.PORT ?? '8765'}/#token=${TOKEN}`);
export const ORIGIN = LINK.origin;
export const SECRET = LINK.hash.replace('#token=', '');

/** Opens the page with the printed link, and a selection if one is given. */
export async function open(page: Page, selection = ''): Promise<void> {
  watchRequests(page);
  const token = `token=${SECRET}`;
  const hash = selection ? `#${selection}${selection.includes('?') ? '&' : '?'}${token}` : `#${token}`;
  // Another fragment alone would not load the page anew.
  await page.goto('about:blank');
  await page.goto(`${ORIGIN}/${hash}`);
  // The map, or the surface in its place.
  await expect(page.locator('#map, .view3d canvas')).toBeVisible();
}

export function mapOf(page: Page): Locator {
  return page.locator('#map');
}

export function valueOf(page: Page): Locator {
  return page.getByRole('status', { name: 'Value at pixel' });
}

/** What the server says. While it still reads the frames it says 503, and is asked again. */
async function get(page: Page, path: string): Promise<Buffer> {
  const headers = { 'x-epirig-token': SECRET };
  let reply: APIResponse | undefined;
  const ask = async (): Promise<number> => {
    reply = await page.request.get(`${ORIGIN}/api/${path}`, { headers });
    return reply.status();
  };
  await expect.poll(ask, { intervals: [200] }).not.toBe(503);
  expect(reply!.ok()).toBe(true);
  return reply!.body();
}

export async function resultsOf(page: Page): Promise<Results> {
  return JSON.parse((await get(page, 'results')).toString()) as Results;
}

export async function pixelOf(page: Page, x: number, y: number): Promise<PixelInfo> {
  const bytes = await get(page, `pixel?x=${x}&y=${y}`);
  return JSON.parse(bytes.subarray(4, 4 + bytes.readUInt32LE(0)).toString()) as PixelInfo;
}

export async function text(page: Page, path: string): Promise<string> {
  return (await get(page, path)).toString();
}

/** A pixel near the middle that has a value. */
export async function foundPixel(page: Page): Promise<{ x: number; y: number }> {
  const { frames } = await resultsOf(page);
  for (let by = 0; by < 40; by += 1) {
    const at = { x: Math.floor(frames.columns * 0.4) + by * 3, y: Math.floor(frames.rows * 0.45) };
    if ((await pixelOf(page, at.x, at.y)).answer === 'found') return at;
  }
  throw new Error('no pixel with a value near the middle');
}

/** Shows a panel of the results, with what the server says for it. */
export async function showPanel(page: Page, name: string): Promise<void> {
  await page.getByRole('tab', { name }).click();
  const panel = page.getByRole('tabpanel', { name });
  await expect(panel).toBeVisible();
  await quiet(page);
  await expect(panel.getByText(/^(loading|computing)…$/)).toHaveCount(0);
}

/** The middle of the map on the screen, once the map is drawn. */
export async function centre(page: Page): Promise<{ x: number; y: number }> {
  await quiet(page);
  const box = await page.locator('.map-values').boundingBox();
  if (!box) throw new Error('the map is not on the screen');
  return { x: box.x + Math.round(box.width) / 2, y: box.y + Math.round(box.height) / 2 };
}
