// The page's own clock, for what depends on time: no slow machine can be too late for a stopped clock.

import type { Page } from '@playwright/test';

/** Far enough ahead that the page is not there yet when it is told to stop. */
const AHEAD_MS = 60_000;

/**
 * Stops the clock of the page: timers, frames and `performance.now()`. From then on `page.clock.runFor` lets
 * time pass, and `page.clock.resume` lets it run.
 */
export async function stopClock(page: Page): Promise<void> {
  await page.clock.install();
  await page.clock.pauseAt(Date.now() + AHEAD_MS);
}
