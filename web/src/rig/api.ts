// The interface of `epirig ui` to the rig and the scan, as types. Requests go through here.

import { get, post } from '../api';

export type Verdict = 'good' | 'unknown' | 'warning' | 'bad';

/** What the rig is doing. While there is a task, other orders than stop are refused. */
export interface Task {
  kind: 'connecting' | 'homing' | 'moving' | 'jogging' | 'doctor' | 'scan' | 'measuring';
  /** In words, for example "moving to 40.000 mm". */
  words: string;
  /** The step in hand and how far it is; null if it cannot be counted. */
  step: string | null;
  done: number | null;
  of: number | null;
  seconds_left: number | null;
}

export interface CameraState {
  /** "busy" while a scan or the doctor uses it; pictures come then, too, but fewer. */
  state: 'connecting' | 'live' | 'busy' | 'lost';
  name: string;
  error: string | null;
  /** Simulated cameras can be shown a cap, a white target, a board. */
  simulated: boolean;
  rows: number;
  columns: number;
  bit_depth: number;
  exposure_us: number | null;
  rate_hz: number | null;
  /** Pictures that arrived in the last second. */
  picture_hz: number | null;
}

/** Light and sharpness of a picture, from all of its raw samples. */
export interface LightState {
  mean_dn: number;
  minimum_dn: number;
  maximum_dn: number;
  full_scale_dn: number;
  /** Pixels. */
  pixels: number;
  saturated: number;
  black: number;
  /** Larger is sharper; comparable for one object only. */
  focus: number;
  focus_peak: number;
  /** Mean light of the four corners over that of the centre, 0 to 1 and more. */
  corners: number | null;
  bin_width_dn: number;
  histogram: number[];
}

/** Corners of a chess-board in the picture. */
export interface TargetState {
  /** The board held by hand, or the boards printed on the object. */
  name: 'board' | 'target';
  wanted: number;
  /** x and y of each corner that was found, in px. */
  corners: [number, number][];
  complete: boolean;
  blur_px: number | null;
  /** Parts of the picture, row by row, in which corners have been seen in shots or while looking. */
  coverage_columns: number;
  coverage_rows: number;
  coverage: boolean[];
}

export interface StageState {
  state: 'connecting' | 'ready' | 'lost';
  name: string;
  error: string | null;
  simulated: boolean;
  /** null while it is not known: not homed. */
  position_mm: number | null;
  homed: boolean;
  moving: boolean;
  at_limit: boolean;
  travel_mm: number;
  /** Positions of the first and the last frame of the plan. */
  plan_mm: [number, number] | null;
  /** Sizes of the step buttons, the smallest first. */
  steps_mm: number[];
  /** How far it can run on if this program dies while a slow or a fast jog is held. */
  runs_on_mm: [slow: number, fast: number];
}

export interface Check {
  name: string;
  verdict: Verdict;
  finding: string;
  advice: string | null;
}

export interface DoctorState {
  at: string;
  short: boolean;
  checks: Check[];
  /** Predicted standard uncertainty of the height of a pixel, in mm. */
  predicted_mm: number | null;
}

export interface Stop {
  index: number;
  attempts: number;
  planned_mm: number;
  reported_mm: number;
  /** Share of the samples, 0 to 1. */
  saturated: number;
  mean_dn: number;
  /** Seconds since the scan began. */
  at_s: number;
}

/** What the scan asks a person to put before the camera. */
export interface Asked {
  kind: 'object' | 'dark' | 'flat' | 'board';
  /** An instruction. */
  words: string;
  pose: number | null;
  poses: number | null;
  /** The shot is taken by itself once the board is seen and still. */
  by_itself: boolean;
  /** Why it was not taken yet, if it is waited for by itself. */
  waiting_for: string | null;
}

export interface LiveMapState {
  /** Counts the maps: another number is another map at `api/scan/map`. */
  number: number;
  /** Frames that it was made of. */
  frames: number;
  /** Medians of all pixels with an answer. */
  sigma_px: number;
  sigma_mm: number | null;
}

export interface ScanState {
  /** Name of the folder of the sequence, and whole path. */
  name: string;
  folder: string;
  state: 'running' | 'pausing' | 'paused' | 'done' | 'failed';
  /** Who holds a paused scan: "operator", "camera", "stage", "disk". */
  held_by: string[];
  /** Why it was paused or has failed, in words. */
  reason: string | null;
  planned: number;
  done: number;
  retakes: { index: number; attempt: number; reason: string }[];
  stops: Stop[];
  asked: Asked | null;
  /** Negative: over the estimate by as much. */
  seconds_left: number | null;
  /** Bytes that are still to be written, without compression, and that are free. */
  needs_bytes: number | null;
  free_bytes: number | null;
  map: LiveMapState | null;
  /** Each live map's frames and median sigma, in px. */
  course: [frames: number, sigma_px: number][];
  /** Whether results are there, so that they can be looked at. */
  measured: boolean;
}

export interface LogLine {
  number: number;
  /** Local time, hh:mm:ss. */
  at: string;
  kind: 'note' | 'warning' | 'error';
  words: string;
}

/** All that is known of the rig, sent whole whenever something changes. */
export interface RigState {
  rig: string;
  task: Task | null;
  stopping: boolean;
  camera: CameraState;
  light: LightState | null;
  target: TargetState | null;
  stage: StageState;
  doctor: DoctorState | null;
  scan: ScanState | null;
  /** The last lines, the newest last. */
  log: LogLine[];
  /** Who has control: the id of a page, or null. */
  controller: string | null;
  free_bytes: number | null;
}

export interface Control {
  name: string;
  kind: 'integer' | 'boolean' | 'menu' | 'bitmask' | 'button' | 'other';
  minimum: number;
  maximum: number;
  step: number;
  default: number;
  value: number | null;
  read_only: boolean;
  inactive: boolean;
  items: [index: number, name: string][];
}

export interface ProfileKey {
  /** With its section, such as "plan.step". */
  path: string;
  name: string;
  meaning: string;
  allowed: string;
  default: string | null;
  example: string;
  choices: string[] | null;
  /** As written, with its unit; null if it is not set. */
  value: string | null;
  /** Whether it has an effect with the chosen drivers. */
  applies: boolean;
}

export interface Profile {
  /** Where it was read: a file, or a simulated rig. */
  source: string;
  /** The file that "save" writes. */
  file: string;
  sections: { name: string; meaning: string; keys: ProfileKey[] }[];
  controls: [name: string, value: string][];
}

export interface ProfileMistake {
  key: string | null;
  words: string;
}

export interface Plan {
  /** A name that is free. */
  name: string;
  /** What a name may be: a regular expression for all of it, and words. */
  names: { pattern: string; words: string };
  folder: string;
  frames: number;
  start_mm: number;
  step_mm: number;
  end_mm: number;
  dark: number;
  flat: number;
  board: number;
  averaged: number;
  seconds: number | null;
  needs_bytes: number | null;
  free_bytes: number | null;
}

export interface SequenceEntry {
  name: string;
  created: string;
  frames: number;
  planned: number;
  ended: string;
  /** Whether `scan/resume` could go on with it. */
  can_be_resumed: boolean;
  measured: boolean;
  /** The depth with its interval of 95 % coverage, in ASCII, if one was found. */
  depth: string | null;
}

export interface LiveMapHead {
  rows: number;
  columns: number;
  /** Pixels of the frames per value, each way. */
  bin: number;
  frames: number;
  planned: number;
  unit: string;
  low: number;
  high: number;
}

export interface PictureHead {
  number: number;
  /** The part of the frame that is shown, in px of the frame. */
  x: number;
  y: number;
  /** Pixels of the frame per value, each way. */
  bin: number;
  rows: number;
  columns: number;
  frame_rows: number;
  frame_columns: number;
  /** Age when it was sent. */
  age_ms: number;
}

const CLIENT = 'epirig-client';

/** Identifies this tab among others with the token; a reload does not change it. */
export const client =
  sessionStorage.getItem(CLIENT) ?? crypto.getRandomValues(new Uint32Array(1))[0]!.toString(36);
sessionStorage.setItem(CLIENT, client);

const order = <T = null>(path: string, asked: object = {}): Promise<T> =>
  post<T>(`api/${path}`, { ...asked, client });

export const rig = {
  /** Whether this page has the token. */
  hello: () => order('rig/hello'),
  take: () => order('rig/take'),
  stop: () => order('rig/stop'),
  home: () => order('rig/home'),
  go: (mm: number) => order('rig/go', { mm }),
  step: (mm: number) => order('rig/step', { mm }),
  /** Held by `keep` every 100 ms; without it the stage stops after 300 ms. */
  jog: (id: number, direction: 1 | -1, fast: boolean) => order('rig/jog', { id, direction, fast }),
  keep: (id: number) => order('rig/keep', { id }),
  release: (id: number) => order('rig/release', { id }),
  controls: () => get<Control[]>('api/rig/controls'),
  setControl: (name: string, value: string) => order<Control[]>('rig/control', { name, value }),
  resetPeak: () => order('rig/reset-peak'),
  findTarget: (on: boolean) => order('rig/target', { on }),
  /** Of a simulated camera: what is before it. */
  show: (what: 'object' | 'dark' | 'flat' | 'board', pose = 0) => order('rig/show', { what, pose }),
  doctor: (short: boolean) => order('rig/doctor', { short }),
  reconnect: () => order('rig/reconnect'),
  profile: () => get<Profile>('api/rig/profile'),
  checkProfile: (values: Record<string, string>) =>
    order<ProfileMistake[]>('rig/profile/check', { values }),
  useProfile: (values: Record<string, string>) => order('rig/profile/use', { values }),
  saveProfile: (values: Record<string, string>, overwrite: boolean) =>
    order<{ file: string }>('rig/profile/save', { values, overwrite }),
  plan: () => get<Plan>('api/scan/plan'),
  startScan: (name: string) => order('scan/start', { name }),
  pauseScan: () => order('scan/pause'),
  resumeScan: (name: string) => order('scan/resume', { name }),
  arranged: (done: boolean) => order('scan/arranged', { done }),
  /** Calibrates if there are frames for it, matches, finds the surface, writes the report. */
  measure: (name: string) => order('scan/measure', { name }),
  sequences: () => get<SequenceEntry[]>('api/sequences'),
  /** Makes a sequence the one that the results view shows. */
  openResults: (name: string) => order('results/open', { name }),
};
