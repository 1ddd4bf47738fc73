// The HTTP interface of `epirig view` and `epirig ui`, as types. Every request of the page goes through here.

import { contactFailed, contactMade } from './store/contact';
import { token } from './store/token';

export interface About {
  program: string;
  version: string;
  mode: 'view' | 'ui';
  rig: boolean;
  may_control: boolean;
  sequence: string | null;
  /** Which results are there; another text after another match, or for another sequence. */
  results: string | null;
}

export interface SequenceInfo {
  name: string;
  uid: string;
  created: string;
  frames: number;
  rows: number;
  columns: number;
  bit_depth: number;
  ended: string;
  end_in_words: string | null;
  origin: string;
}

export interface MatchInfo {
  name: string;
  program: string;
  positions: string;
  calibrated: boolean;
  reference: number;
  quick: boolean;
  /** Share of the pixels that belong to the object, and of these the answered ones, from 0 to 1. */
  object: number;
  object_answered: number;
  median_disparity_px: number | null;
  median_sigma_px: number | null;
  minimum_px: number;
  maximum_px: number;
  seconds: number;
  tau: number[];
}

export type Colours = 'viridis' | 'cividis' | 'magma' | 'grey' | 'vik' | 'mask';

export interface Histogram {
  low: number;
  high: number;
  counts: number[];
}

/** A class of pixels, and its share of all pixels from 0 to 1. */
export interface MapClass {
  name: string;
  share: number;
}

export interface MapInfo {
  id: string;
  title: string;
  unit: string;
  rows: number;
  columns: number;
  levels: number;
  valid: number;
  share_valid: number;
  low: number | null;
  high: number | null;
  /** Whether this range was widened to take in connected pixels beyond 0.5 % and 99.5 % of the values. */
  widened: boolean;
  minimum: number | null;
  maximum: number | null;
  histogram: Histogram;
  colours: Colours;
  scale: 'linear' | 'log';
  /** What the values 0, 1, ... stand for; empty for quantities. */
  classes: MapClass[];
}

export type FrameKind = 'raw' | 'rectified';

export interface FramesInfo {
  count: number;
  rows: number;
  columns: number;
  bit_depth: number;
  reference: number;
  kinds: FrameKind[];
  matched: FrameKind;
}

export interface Depth {
  depth_mm: number;
  sigma_mm: number | null;
  half_width_95_mm: number | null;
}

/** A contribution to the uncertainty of a depth. */
export interface Contribution {
  name: string;
  evaluation: 'A' | 'B';
  /** `null` if it is not known. */
  sigma_mm: number | null;
  share: number | null;
}

/** The uncertainty budget of a depth. */
export interface Budget {
  contributions: Contribution[];
  /** `null` if the scatter is not known. */
  combined: { sigma_mm: number; coverage_factor: number; half_width_95_mm: number } | null;
}

export interface Part {
  centre_x_px: number;
  centre_y_px: number;
  area_px: number;
  area_mm2: number;
  used_px: number;
  depth: Depth;
}

export interface Roughness {
  sa_mm: number;
  sq_mm: number;
  sz_mm: number;
  /** `null` behind an S-filter. */
  sq_noise_mm: number | null;
  sq_without_noise_mm: number | null;
  pixels: number;
}

/** The answer, as terminal and report give it. */
export interface Conclusion {
  sentence: string;
  /** `null` if nothing is planned. */
  planned_mm: number | null;
  /** `null` if nothing is planned or measured. */
  as_planned: boolean | null;
}

/** `surface.json`, as far as the page reads it. */
export interface SurfaceSummary {
  conclusion: Conclusion;
  distance_mm: number;
  pixel_mm: number;
  field?: { answered_px: number; used_px: number; mask?: { file: string; inside_px: number } | null };
  tilt_deg?: [number, number];
  bow_mm?: number;
  levels: {
    depth: Depth;
    budget: Budget;
    raised: boolean;
    margin_px: number;
    parts: Part[];
    roughness: Roughness | null;
  } | null;
  no_levels: string | null;
  roughness: Roughness;
}

export interface Geometry {
  pixel_mm: number;
  distance_mm: number;
  /** The pixel whose x and y are 0 mm, if the server tells it. */
  origin_px?: [x: number, y: number];
}

export interface Results {
  /** As `results` of `About`. */
  id: string;
  sequence: SequenceInfo;
  results: MatchInfo | null;
  others: string[];
  geometry: Geometry | null;
  surface: SurfaceSummary | null;
  /** What exists and is not shown, and why. */
  unfit: string | null;
  /** The part of the picture that has answers. */
  answered_px: [x0: number, y0: number, x1: number, y1: number] | null;
  maps: MapInfo[];
  frames: FramesInfo;
}

export type Answer =
  'found' | 'leaves-image' | 'beyond-range' | 'no-texture' | 'occluded' | 'ambiguous' | 'outside';

export interface PixelValue {
  id: string;
  title: string;
  unit: string;
  value: number | null;
  sigma: number | null;
}

/** The value of one pixel of a map or a frame, at full resolution. */
export interface OneValue {
  value: number | null;
  sigma: number | null;
  /** Why a map has no value there. */
  reason: string | null;
}

export interface Neighbour {
  column: number;
  row: number;
  disparity_px: number;
  agrees: boolean;
}

/** DN per frame along the fitted line and its neighbours; null where out of view. */
export interface Intensity {
  along: (number | null)[];
  left: (number | null)[];
  right: (number | null)[];
}

export interface PixelInfo {
  rows: number;
  columns: number;
  x: number;
  y: number;
  x_mm: number | null;
  y_mm: number | null;
  answer: Answer;
  reason: string;
  values: PixelValue[];
  better_than: number | null;
  epi: { first_column: number; low: number; high: number };
  tau: number[];
  reference: number;
  line: { column: number; disparity_px: number; sigma_px: number } | null;
  neighbours: Neighbour[];
  intensity: Intensity | null;
  cost: {
    disparity_px: number[];
    cost: (number | null)[];
    scale: string;
    chosen_px: number | null;
  } | null;
}

export interface RowCost {
  rows: number;
  columns: number;
  y: number;
  first_px: number;
  step_px: number;
  mapping: (number | null)[];
}

export interface LinePoint {
  x_px: number;
  y_px: number;
  distance_mm?: number;
  height_mm?: number | null;
  sigma_mm?: number | null;
  distance_px?: number;
  disparity_px?: number | null;
  sigma_px?: number | null;
}

export interface LineInfo {
  unit: 'mm' | 'px';
  points: LinePoint[];
}

export interface Trend {
  name: string;
  title: string;
}

export interface MeshInfo {
  rows: number;
  columns: number;
  step: number;
  pixel_mm: number;
  low_mm: number;
  high_mm: number;
  distance_mm: number;
}

export interface CompareInfo {
  rows: number;
  columns: number;
  unit: string;
  step?: number;
  count: number;
  mean: number | null;
  standard_deviation: number | null;
  median: number | null;
  in_sigma: { one: number; two: number } | null;
}

export interface StageFrame {
  index: number;
  planned_mm: number | null;
  reported_mm: number | null;
  error_um: number | null;
  measured_error_px: number | null;
  retakes: number;
  note?: string | null;
}

export interface StageInfo {
  frames: StageFrame[];
  retakes: { frame: number; reason: string }[];
  events: { at: string; words: string }[];
}

export interface CalibrationInfo {
  figures: { name: string; title: string }[];
  notes?: string[];
  needs?: string[];
  [key: string]: unknown;
}

export interface Download {
  name: string;
  title: string;
  bytes: number;
}

/** A reply of JSON followed by float32 values. */
export interface Framed<T> {
  head: T;
  values: Float32Array;
}

/** The server answered, and its answer was a failure in words. */
export class ApiError extends Error {
  constructor(
    message: string,
    readonly status: number,
  ) {
    super(message);
  }
}

async function request(path: string, options: RequestInit = {}): Promise<Response> {
  const headers = new Headers(options.headers);
  if (token()) headers.set('x-epirig-token', token());
  let reply: Response;
  try {
    reply = await fetch(path, { ...options, headers, cache: 'no-store' });
  } catch (error) {
    if (error instanceof DOMException && error.name === 'AbortError') throw error;
    contactFailed();
    // Each browser has words of its own for it, and none is of use to a person.
    throw new Error('The server does not answer.', { cause: error });
  }
  contactMade();
  if (reply.ok) return reply;
  if (reply.status === OUTDATED) whenOutdated();
  const said = (await reply.json().catch(() => null)) as { error?: { message?: string } } | null;
  throw new ApiError(said?.error?.message ?? `${path}: the server answered ${reply.status}`, reply.status);
}

async function json<T>(path: string, options?: RequestInit): Promise<T> {
  return (await (await request(path, options)).json()) as T;
}

export const get = <T>(path: string): Promise<T> => json<T>(path);

export const post = <T>(path: string, asked: object, signal?: AbortSignal): Promise<T> =>
  json<T>(path, {
    method: 'POST',
    headers: { 'content-type': 'application/json' },
    body: JSON.stringify(asked),
    signal: signal ?? null,
  });

/** Takes a framed reply apart; see API "framed arrays". */
export function unframe<T>(buffer: ArrayBuffer): Framed<T> {
  const length = new DataView(buffer).getUint32(0, true);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length));
  return { head: JSON.parse(text) as T, values: new Float32Array(buffer, 4 + length) };
}

export async function framed<T>(path: string, options?: RequestInit): Promise<Framed<T>> {
  return unframe<T>(await (await request(path, options)).arrayBuffer());
}

async function blob(path: string): Promise<Blob> {
  return (await request(path)).blob();
}

/** The results that the page shows: the server refuses questions about others, see `Outdated`. */
let shownResults: string | null = null;

export function askAbout(id: string | null): void {
  shownResults = id;
}

/** What the page does when the results are other ones by now. */
let whenOutdated: () => void = () => undefined;

export function onOutdated(act: () => void): void {
  whenOutdated = act;
}

const OUTDATED = 409;

/** The path with the results that it is about. */
function of(path: string): string {
  if (shownResults === null) return path;
  return `${path}${path.includes('?') ? '&' : '?'}of=${shownResults}`;
}

function query(values: Record<string, string | number>): string {
  return new URLSearchParams(Object.entries(values).map(([key, value]) => [key, String(value)])).toString();
}

export interface LineEnds {
  x0: number;
  y0: number;
  x1: number;
  y1: number;
  width: number;
}

const part = encodeURIComponent;

/** A picture whose white pixels are inside, as a file. */
export interface Mask {
  name: string;
  /** The bytes of the file. */
  base64: string;
}

/** The part of the map that is asked for: a pixel must lie in both region and mask. */
export interface SurfaceQuestion {
  region: [x0: number, y0: number, x1: number, y1: number] | null;
  mask: Mask | null;
  trend: string;
}

export const api = {
  about: () => json<About>('api/about'),
  results: () => json<Results>('api/results'),
  trends: () => json<Trend[]>('api/trends'),
  stage: () => json<StageInfo>(of('api/stage')),
  calibration: () => json<CalibrationInfo | null>(of('api/calibration')),
  calibrationFigure: (name: string) => blob(of(`api/calibration/${part(name)}.png`)),
  downloads: () => json<Download[]>(of('api/downloads')),
  download: (name: string) => blob(of(`api/download/${name.split('/').map(part).join('/')}`)),
  pixel: (x: number, y: number, signal: AbortSignal) =>
    framed<PixelInfo>(of(`api/pixel?${query({ x, y })}`), { signal }),
  /** `asked` names a map or a frame, and a pixel. */
  value: (asked: string, signal: AbortSignal) => json<OneValue>(of(`api/value?${asked}`), { signal }),
  rowCost: (y: number, signal: AbortSignal) =>
    framed<RowCost>(of(`api/row-cost?${query({ y })}`), { signal }),
  line: (ends: LineEnds, signal: AbortSignal) =>
    json<LineInfo>(of(`api/line?${query({ ...ends })}`), { signal }),
  lineCsv: (ends: LineEnds) => blob(of(`api/line.csv?${query({ ...ends })}`)),
  mesh: (most: number) => framed<MeshInfo>(of(`api/mesh?${query({ most })}`)),
  compare: (other: string, map: string) =>
    framed<CompareInfo>(of(`api/compare?${query({ with: other, map })}`)),
  surface: (asked: SurfaceQuestion, signal: AbortSignal) =>
    post<SurfaceSummary>('api/surface', { ...asked, of: shownResults }, signal),
  /** One tile of 256 x 256 values; `path` is that of its map or frame. */
  tile: async (path: string, signal: AbortSignal) =>
    new Float32Array(await (await request(of(path), { signal })).arrayBuffer()),
};
