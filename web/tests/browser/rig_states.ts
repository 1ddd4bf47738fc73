// States of the rig that are looked at and checked for access.

import { expect, type Page } from '@playwright/test';
import type { RigState } from '../../src/rig/api';
import { FakeRig, startState } from './fake_rig';

const start = startState();

const DOCTOR: RigState['doctor'] = {
  at: '14:05:20',
  short: false,
  checks: [
    { name: 'light', verdict: 'good', finding: 'mean 44 % of full scale', advice: null },
    { name: 'noise', verdict: 'good', finding: 'sigma 5.1 DN at the mean', advice: null },
    { name: 'linearity', verdict: 'unknown', finding: 'no series of exposures', advice: null },
    {
      name: 'vignetting',
      verdict: 'warning',
      finding: 'corners 31 % darker than the centre',
      advice: 'Is a lens hood or a cap in the way? Else take flat frames.',
    },
    {
      name: 'saturation',
      verdict: 'bad',
      finding: '0.02 % of the pixels are saturated',
      advice: 'Shorten the exposure to 6 ms.',
    },
  ],
  predicted_mm: 0.00412,
};

const TARGET: RigState['target'] = {
  name: 'board',
  wanted: 54,
  corners: Array.from({ length: 54 }, (_, at): [number, number] => [
    160 + (at % 9) * 38,
    130 + Math.floor(at / 9) * 38,
  ]),
  complete: true,
  blur_px: 1.34,
  coverage_columns: 3,
  coverage_rows: 3,
  coverage: [true, true, false, false, true, true, false, false, true],
};

const scan = (change: object): RigState['scan'] => ({
  name: 'set-0412',
  folder: '/data/set-0412',
  state: 'paused',
  held_by: ['operator'],
  reason: null,
  planned: 101,
  done: 37,
  retakes: [],
  stops: [],
  asked: null,
  seconds_left: 240,
  needs_bytes: null,
  free_bytes: 398e9,
  map: null,
  course: [],
  measured: false,
  ...change,
});

export const STATES: [name: string, change: Partial<RigState>][] = [
  ['ready', { doctor: DOCTOR, target: TARGET }],
  ['homing', { task: { ...task('homing', 'homing'), done: null } }],
  ['doctor', { task: { ...task('doctor', 'doctor: whole run'), step: 'noise' } }],
  ['not-homed', { stage: { ...start.stage, homed: false, position_mm: null } }],
  ['camera-lost', { camera: { ...start.camera, state: 'lost', error: 'the cable was unplugged' } }],
  ['stage-lost', { stage: { ...start.stage, state: 'lost', error: 'no reply on the serial port' } }],
  ['paused', { scan: scan({ held_by: ['operator', 'disk'] }) }],
  ['disk', { scan: scan({ state: 'running', needs_bytes: 3.1e9, free_bytes: 2.2e9 }) }],
  ['stopping', { stopping: true, stage: { ...start.stage, moving: true } }],
  ['other', { controller: 'another' }],
];

function task(kind: 'homing' | 'doctor', words: string): NonNullable<RigState['task']> {
  return { kind, words, step: null, done: 3, of: 10, seconds_left: 52, stops: false };
}

/** Opens the rig view in a state, with a picture on the screen. */
export async function openIn(page: Page, change: Partial<RigState>): Promise<FakeRig> {
  const rig = new FakeRig(page);
  rig.state = { ...rig.state, ...change };
  await rig.open();
  await expect(page.locator('.bar-rate')).toContainText('ms old');
  await rig.shown();
  return rig;
}
