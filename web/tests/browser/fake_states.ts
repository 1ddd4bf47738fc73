// States of the fake rig, and what it answers.

import type { Plan, Profile, ProfileKey, RigState, ScanState, SequenceEntry } from '../../src/rig/api';

export function idle(): RigState {
  return {
    rig: 'test rig',
    task: null,
    stopping: false,
    camera: {
      state: 'live',
      name: 'simulated camera',
      error: null,
      simulated: true,
      rows: 384,
      columns: 512,
      bit_depth: 8,
      exposure_us: 8000,
      rate_hz: 25,
      picture_hz: 24.8,
    },
    light: null,
    target: null,
    stage: {
      state: 'ready',
      name: 'simulated stage',
      error: null,
      simulated: true,
      position_mm: 18.5,
      homed: true,
      moving: false,
      at_limit: false,
      travel_mm: 100,
      plan_mm: [0, 50],
      steps_mm: [0.01, 0.1, 1],
      runs_on_mm: [0.3, 3],
    },
    doctor: null,
    scan: null,
    log: [
      { number: 1, at: '14:00:02', kind: 'note', words: 'scan tile-0413 begins' },
      {
        number: 2,
        at: '14:02:11',
        kind: 'warning',
        words: 'frame 29 retaken: mean light fell 4.1 % (limit 2 %)',
      },
    ],
    controller: null,
    free_bytes: 398e9,
  };
}

export function scanning(change: Partial<ScanState> = {}): RigState {
  const stops = Array.from({ length: 37 }, (_, index) => ({
    index,
    attempts: index === 11 || index === 29 ? 2 : 1,
    planned_mm: index * 0.5,
    reported_mm: index * 0.5 + 0.0006 * Math.sin(index * 1.7) - (index === 36 ? 0.0004 : 0),
    saturated: 0.00021,
    mean_dn: 118 - 3 * Math.sin(index / 6),
    at_s: index * 6,
  }));
  stops[36]!.reported_mm = 18 - 0.0004;
  const scan: ScanState = {
    name: 'tile-0413',
    folder: '/data/tile-0413',
    state: 'running',
    held_by: [],
    reason: null,
    planned: 101,
    done: 37,
    retakes: [
      { index: 11, attempt: 1, reason: 'the picture shook' },
      { index: 29, attempt: 1, reason: 'mean light fell 4.1 % (limit 2 %)' },
    ],
    stops,
    asked: null,
    seconds_left: 243,
    needs_bytes: 3.1e9,
    free_bytes: 398e9,
    map: { number: 5, frames: 37, sigma_px: 0.0091, sigma_mm: 0.0012 },
    course: [
      [12, 0.024],
      [18, 0.0171],
      [24, 0.0132],
      [31, 0.0107],
      [37, 0.0091],
    ],
    measured: false,
    ...change,
  };
  const task = {
    kind: 'scan' as const,
    words: 'scanning 37 of 101',
    step: null,
    done: 37,
    of: 101,
    seconds_left: 243,
    stops: false,
  };
  const ended = scan.state === 'done' || scan.state === 'failed';
  return { ...idle(), scan, task: ended ? null : task };
}

export const PLAN: Plan = {
  name: 'tile-0414',
  // As the server tells it.
  names: {
    pattern: '[A-Za-z0-9](?:[A-Za-z0-9_.\\-]{0,78}[A-Za-z0-9_\\-])?',
    words: 'a name has at most 80 characters: a to z, A to Z, 0 to 9, and inside of it also - _ and .',
  },
  folder: '/data',
  frames: 101,
  start_mm: 0,
  step_mm: 0.5,
  end_mm: 50,
  dark: 16,
  flat: 16,
  board: 12,
  averaged: 4,
  seconds: 730,
  needs_bytes: 4.6e9,
  free_bytes: 412e9,
};

export const SEQUENCES: SequenceEntry[] = [
  {
    name: 'tile-0412',
    created: '2026-11-24T13:02:00Z',
    frames: 101,
    planned: 101,
    ended: 'complete',
    can_be_resumed: false,
    state: 'measured',
    depth_mm: 0.2,
    half_width_95_mm: 0.0079,
    verdict: 'pass',
    problem: null,
    picture: null,
  },
  {
    name: 'tile-0411',
    created: '2026-11-24T11:40:00Z',
    frames: 101,
    planned: 101,
    ended: 'complete',
    can_be_resumed: false,
    state: 'scan',
    depth_mm: null,
    half_width_95_mm: null,
    verdict: null,
    problem: null,
    picture: null,
  },
  {
    name: 'tile-0410',
    created: '2026-11-24T10:12:00Z',
    frames: 44,
    planned: 101,
    ended: 'stopped by the operator',
    can_be_resumed: true,
    state: 'scan',
    depth_mm: null,
    half_width_95_mm: null,
    verdict: null,
    problem: null,
    picture: null,
  },
];

function key(path: string, change: Partial<ProfileKey>): ProfileKey {
  return {
    path,
    name: path.split('.')[1]!,
    meaning: 'What it means',
    allowed: 'a length greater than 0',
    default: null,
    example: '1.5 mm',
    choices: null,
    value: null,
    applies: true,
    ...change,
  };
}

export const PROFILE: Profile = {
  source: '/data/bench.toml',
  file: '/data/bench.toml',
  sections: [
    {
      name: 'stage',
      meaning: 'The stage and its connection',
      keys: [
        key('stage.driver', {
          meaning: 'Protocol of the stage',
          allowed: 'one of native, grbl, zaber, sim',
          choices: ['native', 'grbl', 'zaber', 'sim'],
          example: 'sim',
          value: 'sim',
        }),
        key('stage.relative', {
          meaning: 'Whether moves are relative',
          allowed: 'true or false',
          default: 'false',
          example: 'true',
        }),
        key('stage.port', {
          meaning: 'Serial port',
          allowed: 'text that is not empty',
          example: '/dev/ttyACM0',
          applies: false,
        }),
      ],
    },
    {
      name: 'camera',
      meaning: 'The camera and its settings',
      keys: [
        key('camera.exposure', {
          meaning: 'Exposure time',
          allowed: 'a time from 1 ns to 1 h',
          default: '10 ms',
          example: '8 ms',
          value: '8 ms',
        }),
      ],
    },
    {
      name: 'plan',
      meaning: 'The scan: positions and frames',
      keys: [
        key('plan.start', {
          meaning: 'Position of the first frame, from home',
          allowed: 'a length of 0 or more',
          default: '0 mm',
          example: '10 mm',
        }),
        key('plan.step', { meaning: 'Distance between stops', value: '0.5 mm' }),
        key('plan.frames', {
          meaning: 'Number of frames: one more than steps',
          allowed: 'a whole number from 2 to 100000',
          example: '101',
          value: '101',
        }),
      ],
    },
  ],
  controls: [
    ['gain', '10'],
    ['black_level', '64'],
  ],
};
