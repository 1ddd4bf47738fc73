// The states of the scan view and the profile form that are looked at and checked for access.

import { expect, type Page } from '@playwright/test';
import type { Asked } from '../../src/rig/api';
import type { FakeRig } from './fake_scan';
import { idle, scanning } from './fake_states';

const ASKED: Asked = {
  kind: 'board',
  words: 'Hold the chess-board so that it fills the left half, and tilt it to the left.',
  pose: 3,
  poses: 12,
  by_itself: true,
  waiting_for: 'the board to be still',
};

export const STATES: Record<string, (rig: FakeRig) => void> = {
  plan: (rig) => void (rig.state = idle()),
  running: (rig) => void (rig.state = scanning()),
  paused: (rig) =>
    void (rig.state = scanning({
      state: 'paused',
      held_by: ['disk'],
      free_bytes: 2e9,
      reason: 'The disk is nearly full.',
    })),
  failed: (rig) =>
    void (rig.state = scanning({
      state: 'failed',
      reason: 'The stage did not reach 18.500 mm in 3 tries.',
    })),
  done: (rig) => void (rig.state = scanning({ state: 'done', done: 101, measured: true })),
  measuring: (rig) => {
    const task = { kind: 'measuring' as const, words: 'measuring tile-0413', step: 'matching' };
    rig.state = {
      ...scanning({ state: 'done', done: 101 }),
      task: { ...task, done: 3, of: 12, seconds_left: 50 },
    };
  },
  asked: (rig) => {
    rig.state = {
      ...scanning({ map: null, course: [], stops: [], retakes: [], done: 0, asked: ASKED }),
      target: {
        name: 'board',
        wanted: 54,
        corners: Array.from({ length: 54 }, (_, corner) => [
          120 + 30 * (corner % 9) + 4 * Math.floor(corner / 9),
          90 + 32 * Math.floor(corner / 9),
        ]),
        complete: true,
        blur_px: 0.4,
        coverage_columns: 3,
        coverage_rows: 3,
        coverage: [true, true, false, true, true, false, false, false, false],
      },
    };
  },
  watching: (rig) => void (rig.state = { ...scanning(), controller: 'bench-2' }),
};

/** Opens the form with all sections, a change and a mistake. */
export async function openProfile(page: Page, rig: FakeRig): Promise<void> {
  rig.check = () => [{ key: 'plan.step', words: 'plan.step = 3 has no unit; write 3 mm.' }];
  await rig.open('profile');
  for (const words of ['The stage and its', 'The camera and its', 'The scan: positions']) {
    await page.getByText(words).click();
  }
  await page.getByLabel('show all').check();
  await page.getByLabel('step').fill('3');
  await expect(page.getByText('1 wrong')).toBeVisible();
}

/** Waits until the state is on the screen, and opens what is folded. */
export async function settled(page: Page): Promise<void> {
  await expect(page.getByRole('main')).toBeVisible();
  await expect(page.getByText('loading…')).toHaveCount(0);
  await page.waitForTimeout(500);
}

export const SIZES = [
  ['wide', 1280, 720],
  ['tablet', 820, 1180],
  ['phone', 390, 844],
] as const;
