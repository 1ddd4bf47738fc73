// The states of the scan view and the profile form that are looked at and checked for access.

import { expect, type Page } from '@playwright/test';
import type { Asked } from '../../src/rig/api';
import type { FakeRig } from './fake_scan';
import { idle, scanning } from './fake_states';
import { quiet } from './quiet';

const ASKED: Asked = {
  kind: 'board',
  words: 'Hold the chess-board so that it fills the left half, and tilt it to the left.',
  pose: 3,
  poses: 12,
  by_itself: true,
  waiting_for: 'the board to be still',
};

interface State {
  set: (rig: FakeRig) => void;
  /** Words by which the state is known on the screen. */
  words: string | RegExp;
}

export const STATES: Record<string, State> = {
  plan: { set: (rig) => void (rig.state = idle()), words: 'about 12 min' },
  running: { set: (rig) => void (rig.state = scanning()), words: 'stops 1–37 of 101' },
  paused: {
    set: (rig) => {
      const reason = 'The disk is nearly full.';
      rig.state = scanning({ state: 'paused', held_by: ['disk'], free_bytes: 2e9, reason });
    },
    words: 'The disk is nearly full.',
  },
  failed: {
    set: (rig) => {
      const reason = 'The stage did not reach 18.500 mm in 3 tries.';
      rig.state = scanning({ state: 'failed', reason });
    },
    words: 'The stage did not reach 18.500 mm in 3 tries.',
  },
  done: {
    set: (rig) => void (rig.state = scanning({ state: 'done', done: 101, measured: true })),
    words: 'Done: 101 frames.',
  },
  measuring: {
    set: (rig) => {
      const task = { kind: 'measuring' as const, words: 'measuring tile-0413', step: 'matching' };
      rig.state = {
        ...scanning({ state: 'done', done: 101 }),
        task: { ...task, done: 3, of: 12, seconds_left: 50, stops: false },
      };
    },
    words: /matching.*3 of 12/,
  },
  asked: {
    set: (rig) => {
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
    words: /pose 3 of 12/,
  },
  watching: {
    set: (rig) => void (rig.state = { ...scanning(), controller: 'bench-2' }),
    words: /Another page has control/,
  },
};

/** Opens the scan view in a state, and waits until all of it is on the screen. */
export async function openIn(page: Page, rig: FakeRig, name: string): Promise<void> {
  const { set, words } = STATES[name]!;
  set(rig);
  await rig.open();
  await expect(page.getByText(words).first()).toBeVisible();
  await expect(page.getByText(/^(loading…|no picture yet)$/)).toHaveCount(0);
  await quiet(page);
}

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
  await quiet(page);
}
