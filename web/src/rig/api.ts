// The interface of `epirig ui` to the rig and the scan. Requests go through here.

import { blob, get, post } from '../api';
import type {
  Control,
  Plan,
  Profile,
  ProfileMistake,
  SequenceEntry,
  SeriesTrend,
  TrendQuestion,
} from '../types';

export type * from '../types';

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
  /** The browser keeps it: a name never has another picture. */
  picture: (name: string, signal: AbortSignal) =>
    blob(`api/sequences/${name}`, { signal, cache: 'default' }),
  /** One quantity over the sequences of these names. */
  trend: (asked: TrendQuestion, signal: AbortSignal) =>
    post<SeriesTrend>('api/sequences/trend', asked, signal),
  /** Makes a sequence the one that the results view shows. */
  openResults: (name: string) => order('results/open', { name }),
};
