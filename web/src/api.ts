// The HTTP interface of `epirig view` and `epirig ui`. Every request of the page goes through here.

import { contactFailed, contactMade } from './store/contact';
import { token } from './store/token';
import type {
  About,
  CalibrationInfo,
  CompareInfo,
  Download,
  LevelledInfo,
  LineEnds,
  LineInfo,
  MeshInfo,
  MeshQuery,
  OneValue,
  Pixel,
  PixelInfo,
  RegionInfo,
  RegionQuery,
  Results,
  RowCost,
  StageInfo,
  SurfaceQuestion,
  SurfaceSummary,
  Trend,
} from './types';

export type * from './types';

export type Colours = 'viridis' | 'cividis' | 'magma' | 'grey' | 'vik' | 'mask';

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
    reply = await fetch(path, { cache: 'no-store', ...options, headers });
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
  json<T>(path, posted(asked, signal));

function posted(asked: object, signal?: AbortSignal): RequestInit {
  return {
    method: 'POST',
    headers: { 'content-type': 'application/json' },
    body: JSON.stringify(asked),
    signal: signal ?? null,
  };
}

/** Takes a framed reply apart; see API "framed arrays". */
export function unframe<T>(buffer: ArrayBuffer): Framed<T> {
  const length = new DataView(buffer).getUint32(0, true);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length));
  return { head: JSON.parse(text) as T, values: new Float32Array(buffer, 4 + length) };
}

export async function framed<T>(path: string, options?: RequestInit): Promise<Framed<T>> {
  return unframe<T>(await (await request(path, options)).arrayBuffer());
}

export async function blob(path: string, options?: RequestInit): Promise<Blob> {
  return (await request(path, options)).blob();
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

/** What is not there is left out. */
function query(values: Record<string, string | number | null>): string {
  const there = Object.entries(values).filter(([, value]) => value !== null);
  return new URLSearchParams(there.map(([key, value]) => [key, String(value)])).toString();
}

const part = encodeURIComponent;

export const api = {
  about: () => json<About>('api/about'),
  results: () => json<Results>('api/results'),
  trends: () => json<Trend[]>('api/trends'),
  stage: () => json<StageInfo>(of('api/stage')),
  calibration: () => json<CalibrationInfo | null>(of('api/calibration')),
  calibrationFigure: (name: string) => blob(of(`api/calibration/${part(name)}.png`)),
  downloads: () => json<Download[]>(of('api/downloads')),
  download: (name: string) => blob(of(`api/download/${name.split('/').map(part).join('/')}`)),
  pixel: (asked: Pixel, signal: AbortSignal) =>
    framed<PixelInfo>(of(`api/pixel?${query({ ...asked })}`), { signal }),
  levelled: (map: string, levelled_by: string, signal: AbortSignal) =>
    json<LevelledInfo>(of(`api/levelled?${query({ map, levelled_by })}`), { signal }),
  region: (asked: RegionQuery, signal: AbortSignal) =>
    json<RegionInfo>(of(`api/region?${query({ ...asked })}`), { signal }),
  /** `asked` names a map or a frame, and a pixel. */
  value: (asked: string, signal: AbortSignal) => json<OneValue>(of(`api/value?${asked}`), { signal }),
  rowCost: (y: number, signal: AbortSignal) =>
    framed<RowCost>(of(`api/row-cost?${query({ y })}`), { signal }),
  line: (ends: LineEnds, signal: AbortSignal) =>
    json<LineInfo>(of(`api/line?${query({ ...ends })}`), { signal }),
  lineCsv: (ends: LineEnds) => blob(of(`api/line.csv?${query({ ...ends })}`)),
  mesh: (asked: MeshQuery) => framed<MeshInfo>(of(`api/mesh?${query({ ...asked })}`)),
  compare: (other: string, map: string) =>
    framed<CompareInfo>(of(`api/compare?${query({ with: other, map })}`)),
  /** The heights on the page less those of another sequence. */
  compareSequence: (sequence: string) =>
    framed<CompareInfo>('api/sequences/compare', posted({ sequence, of: shownResults })),
  surface: (asked: SurfaceQuestion, signal: AbortSignal) =>
    post<SurfaceSummary>('api/surface', { ...asked, of: shownResults }, signal),
  /** One tile of 256 x 256 values; `path` is that of its map or frame. */
  tile: async (path: string, signal: AbortSignal) =>
    new Float32Array(await (await request(of(path), { signal })).arrayBuffer()),
};
