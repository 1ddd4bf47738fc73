// When a page has come to rest: what it asked for was answered, and what came is on the screen.

import { expect, type Page, type Request } from '@playwright/test';

const unanswered = new WeakMap<Page, Set<Request>>();

/** Counts the requests of the page from now on. Call it before the page is opened. */
export function watchRequests(page: Page): void {
  if (unanswered.has(page)) return;
  const running = new Set<Request>();
  unanswered.set(page, running);
  page.on('request', (request) => {
    // The page asks this again and again, to know whether the server is there.
    if (request.url().endsWith('/api/about')) return;
    // Another document: nobody waits for what the one before has asked.
    if (request.isNavigationRequest() && request.frame() === page.mainFrame()) running.clear();
    running.add(request);
  });
  page.on('requestfinished', (request) => running.delete(request));
  page.on('requestfailed', (request) => running.delete(request));
}

/** Waits until what the page knows is drawn: effects of a drawing come after its frame. */
export async function drawn(page: Page): Promise<void> {
  await page.evaluate(
    () =>
      new Promise<void>((done) => {
        requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done)));
      }),
  );
}

/**
 * Waits until the page has an answer to each request, and has drawn it. What it asks only after a pause of its
 * own is not seen here: wait for what it shows.
 */
export async function quiet(page: Page): Promise<void> {
  const running = unanswered.get(page);
  if (!running) throw new Error('watchRequests was not called before the page was opened');
  await expect(async () => {
    await drawn(page);
    expect([...running].map((request) => request.url())).toEqual([]);
  }).toPass({ intervals: [20, 50, 100] });
}
