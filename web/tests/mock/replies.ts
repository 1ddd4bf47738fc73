// Replies of the mock server, computed from the truth.

import { levelledAt, mrad, planeBy } from './levelling';
import * as truth from './truth';
import type {
  CalibrationInfo,
  LevelledInfo,
  LineInfo,
  MapClass,
  MapInfo,
  MatchInfo,
  OneValue,
  PixelInfo,
  Results,
  RowCost,
  StageInfo,
  SurfaceSummary,
} from '../../src/api';

const { COLUMNS, ROWS, FRAMES, REFERENCE, TAU, PIXEL_MM } = truth;
const ANSWERS = ['found', 'leaves-image', 'beyond-range', 'no-texture', 'occluded', 'ambiguous'] as const;
const LEVELS = 3;

const grids = new Map<string, Float32Array>();

function gridOf(map: truth.MapTruth): Float32Array {
  let grid = grids.get(map.id);
  if (!grid) {
    grid = Float32Array.from({ length: ROWS * COLUMNS }, (_, index) =>
      map.at(index % COLUMNS, Math.floor(index / COLUMNS)),
    );
    grids.set(map.id, grid);
  }
  return grid;
}

const infos = new Map<string, MapInfo>();

/** What is said of a map. All values are sorted for it, so it is found once. */
function infoOf(map: truth.MapTruth): MapInfo {
  let info = infos.get(map.id);
  if (!info) infos.set(map.id, (info = infoFrom(map)));
  return info;
}

function infoFrom(map: truth.MapTruth, grid = gridOf(map)): MapInfo {
  const valid = grid.filter(Number.isFinite).sort();
  const quantile = (share: number): number => valid[Math.round(share * (valid.length - 1))] ?? 0;
  const [minimum, maximum] = [quantile(0), quantile(1)];
  const counts = new Array<number>(256).fill(0);
  for (const value of valid) {
    const bin = Math.min(Math.floor(((value - minimum) / (maximum - minimum)) * 256), 255);
    counts[bin] = (counts[bin] ?? 0) + 1;
  }
  const classOf = (name: string, code: number): MapClass => ({
    name,
    share: valid.filter((one) => one === code).length / (ROWS * COLUMNS),
  });
  return {
    id: map.id,
    title: map.title,
    unit: map.unit,
    rows: ROWS,
    columns: COLUMNS,
    levels: LEVELS,
    valid: valid.length,
    share_valid: valid.length / (ROWS * COLUMNS),
    low: quantile(0.005),
    high: quantile(0.995),
    widened: false,
    minimum,
    maximum,
    histogram: { low: minimum, high: maximum, counts },
    colours: map.colours as MapInfo['colours'],
    scale: map.scale as MapInfo['scale'],
    classes: map.id === 'mask' ? truth.ANSWERS.map(classOf) : [],
  };
}

/** A tile of 256 x 256 values; a value of level k is the mean of the valid ones of 2^k x 2^k. */
export function tile(
  at: (x: number, y: number) => number,
  nearest: boolean,
  level: number,
  row: number,
  column: number,
): Float32Array {
  const side = 2 ** level;
  return Float32Array.from({ length: 256 * 256 }, (_, index) => {
    const x = (column * 256 + (index % 256)) * side;
    const y = (row * 256 + Math.floor(index / 256)) * side;
    if (x >= COLUMNS || y >= ROWS) return NaN;
    if (nearest) return at(x, y);
    let [sum, count] = [0, 0];
    for (let dy = 0; dy < side; dy += 1) {
      for (let dx = 0; dx < side; dx += 1) {
        const value = x + dx < COLUMNS && y + dy < ROWS ? at(x + dx, y + dy) : NaN;
        if (Number.isFinite(value)) [sum, count] = [sum + value, count + 1];
      }
    }
    return count > 0 ? sum / count : NaN;
  });
}

/** The heights less a plane; the page asks for the same one again and again. */
function levelledGrid(by: string): Float32Array {
  let grid = grids.get(by);
  if (!grid) {
    const at = levelledAt(by);
    grid = Float32Array.from({ length: ROWS * COLUMNS }, (_, index) => {
      const [x, y] = [index % COLUMNS, Math.floor(index / COLUMNS)];
      return truth.codeAt(x, y) === 0 ? at(x, y) : NaN;
    });
    grids.set(by, grid);
  }
  return grid;
}

/** What is known of the levelled heights; null if there is no plane. */
export function levelled(by: string): LevelledInfo | null {
  const plane = planeBy(by);
  const height = truth.MAPS.find(({ id }) => id === 'height');
  if (!plane || !height) return null;
  const { valid, share_valid, low, high, widened, minimum, maximum, histogram } = infoFrom(
    height,
    levelledGrid(by),
  );
  const [tilt_x_mrad, tilt_y_mrad] = plane.slopes.map(mrad) as [number, number];
  return { tilt_x_mrad, tilt_y_mrad, valid, share_valid, low, high, widened, minimum, maximum, histogram };
}

export function mapTile(
  id: string,
  level: number,
  row: number,
  column: number,
  by: string | null,
): Float32Array | null {
  const map = truth.MAPS.find((one) => one.id === id);
  if (!map) return null;
  const grid = by === null ? gridOf(map) : levelledGrid(by);
  return tile((x, y) => grid[y * COLUMNS + x] ?? NaN, map.nearest, level, row, column);
}

export const CALIBRATION: CalibrationInfo = {
  figures: [{ name: 'lens', title: 'Distortion of the lens' }],
  notes: ['the lens was calibrated with 12 views of a board'],
  needs: [],
};

/** As far as the page reads it. */
export const SURFACE = {
  conclusion: {
    sentence:
      'hollows 0.1999 mm +- 0.0079 mm deep (95 % coverage, baseline taken as exact), as planned: 0.2 mm lies within the interval',
    depth: '0.1999 mm +- 0.0079 mm',
    planned_mm: 0.2,
    as_planned: true,
    verdict: 'pass',
    verdict_sentence:
      'PASS by guarded-risk, risk 5.0 %; depth: 0.1999 mm +- 0.0079 mm, limits 0.18 mm to 0.22 mm, conformance probability above 99.9 %',
  },
  distance_mm: 300,
  pixel_mm: PIXEL_MM,
  levels: {
    depth: { depth_mm: 0.19987, sigma_mm: 0.00044, half_width_95_mm: 0.00091 },
    budget: {
      contributions: [
        {
          name: 'scatter between independent parts of the field',
          evaluation: 'A',
          sigma_mm: 0.00044,
          share: 0.012,
        },
        { name: 'walls: other margins', evaluation: 'B', sigma_mm: 0.00022, share: 0.003 },
        { name: 'scale: focal length', evaluation: 'B', sigma_mm: 0.004, share: 0.985 },
        { name: 'scale: length of the baseline', evaluation: 'B', sigma_mm: null, share: null },
      ],
      combined: { sigma_mm: 0.00403, coverage_factor: 1.96, half_width_95_mm: 0.0079 },
    },
    raised: false,
    margin_px: 3,
    parts: [
      [452, 150, 10.05],
      [180, 160, 9.62],
    ].map(([x, y, area]) => ({
      centre_x_px: x!,
      centre_y_px: y!,
      area_px: 15000,
      area_mm2: area!,
      used_px: 13000,
      depth: { depth_mm: 0.2001, sigma_mm: 0.0006, half_width_95_mm: 0.0013 },
    })),
    roughness: null,
  },
  no_levels: null,
  roughness: {
    sa_mm: 0.0122,
    sq_mm: 0.0151,
    sz_mm: 0.4113,
    sq_noise_mm: 0.0011,
    sq_without_noise_mm: 0.015,
    pixels: 290000,
  },
} as unknown as SurfaceSummary;

export function results(): Results {
  return {
    id: 'mock',
    sequence: {
      name: 'mock-0042',
      uid: 'f00d',
      created: '2026-11-24T13:00:00Z',
      frames: FRAMES,
      rows: ROWS,
      columns: COLUMNS,
      bit_depth: 12,
      ended: 'complete',
      end_in_words: null,
      origin: 'simulated rig',
    },
    results: {
      name: 'results',
      program: 'epirig 0.0.0',
      positions: 'target',
      calibrated: true,
      reference: REFERENCE,
      quick: false,
      object: 0.9,
      object_answered: 0.95,
      median_disparity_px: 20,
      median_sigma_px: 0.006,
      minimum_px: 16,
      maximum_px: 24,
      seconds: 12.4,
      tau: TAU.map((tau) => tau + 0.5),
    } as unknown as MatchInfo,
    others: ['look'],
    geometry: { pixel_mm: PIXEL_MM, distance_mm: 300, origin_px: [0, 0] },
    surface: SURFACE,
    unfit: null,
    answered_px: [0, 0, 616, ROWS],
    maps: truth.MAPS.map(infoOf),
    frames: {
      count: FRAMES,
      rows: ROWS,
      columns: COLUMNS,
      bit_depth: 12,
      reference: REFERENCE,
      kinds: ['raw', 'rectified'],
      matched: 'rectified',
    },
  };
}

export function pixel(x: number, y: number, by: string | null): [PixelInfo, Float32Array] {
  const code = truth.codeAt(x, y);
  const found = code === 0;
  const disparity = truth.disparityAt(x, y);
  const first = Math.max(x - 45, 0);
  const columns = Math.min(x + 46, COLUMNS) - first;
  const epi = Float32Array.from({ length: FRAMES * columns }, (_, index) =>
    truth.frameAt(Math.floor(index / columns), first + (index % columns), y),
  );
  const alongLine = (offset: number): (number | null)[] =>
    TAU.map((tau, t) => truth.frameAt(t, x + offset + disparity * tau, y));
  const candidates = Array.from({ length: 161 }, (_, index) => 16 + index * 0.05);
  const value = (id: string, title: string, unit: string, at: number, sigma: number | null) => ({
    id,
    title,
    unit,
    value: found ? at : null,
    sigma: found ? sigma : null,
  });
  const neighbours = [-1, 0, 1].flatMap((dy) =>
    [-1, 0, 1].flatMap((dx) => {
      const [column, row] = [x + dx, y + dy];
      if ((dx === 0 && dy === 0) || truth.codeAt(column, row) !== 0) return [];
      const other = truth.disparityAt(column, row);
      return [{ column, row, disparity_px: other, agrees: Math.abs(other - disparity) < 0.3 }];
    }),
  );
  return [
    {
      rows: FRAMES,
      columns,
      x,
      y,
      x_mm: x * PIXEL_MM,
      y_mm: y * PIXEL_MM,
      answer: ANSWERS[code]!,
      reason: truth.ANSWERS[code]!,
      values: [
        value('height', 'height', 'mm', levelledAt(by)(x, y), truth.sigmaMmAt(x, y)),
        value('disparity', 'disparity', 'px', disparity, truth.sigmaPxAt(x, y)),
        value('confidence', 'confidence', '', 0.93, null),
        value('cost', 'cost', 'DN²', 231, null),
      ],
      better_than: found ? 0.78 : null,
      epi: { first_column: first, low: 600, high: 3000 },
      tau: TAU,
      reference: REFERENCE,
      line: found ? { column: x, disparity_px: disparity, sigma_px: truth.sigmaPxAt(x, y) } : null,
      neighbours: found ? neighbours : [],
      intensity: found ? { along: alongLine(0), left: alongLine(-1), right: alongLine(1) } : null,
      cost: {
        disparity_px: candidates,
        cost: candidates.map((at) => 225 + 60000 * (1 - Math.exp(-(((at - disparity) / 0.8) ** 2)))),
        scale: 'DN²',
        chosen_px: found ? disparity : null,
      },
    },
    epi,
  ];
}

/** One value of a map or a frame; null if there is no such map. */
export function value(query: URLSearchParams): OneValue | null {
  const [x, y] = [Number(query.get('x')), Number(query.get('y'))];
  const frame = query.get('frame');
  if (frame !== null) return { value: truth.frameAt(Number(frame), x, y), sigma: null, reason: null };
  const map = truth.MAPS.find(({ id }) => id === query.get('map'));
  if (!map) return null;
  const by = query.get('levelled_by');
  const at = by === null || truth.codeAt(x, y) !== 0 ? map.at(x, y) : levelledAt(by)(x, y);
  const sigmas: Record<string, (x: number, y: number) => number> = {
    height: truth.sigmaMmAt,
    disparity: truth.sigmaPxAt,
  };
  if (!Number.isFinite(at)) return { value: null, sigma: null, reason: truth.ANSWERS[truth.codeAt(x, y)]! };
  return { value: Math.fround(at), sigma: sigmas[map.id]?.(x, y) ?? null, reason: null };
}

export function rowCost(y: number): [RowCost, Float32Array] {
  const rows = 81;
  const values = Float32Array.from({ length: rows * COLUMNS }, (_, index) => {
    const [x, candidate] = [index % COLUMNS, 16 + Math.floor(index / COLUMNS) * 0.1];
    if (x >= 616) return NaN;
    return (
      0.002 +
      (1 - Math.exp(-(((candidate - truth.disparityAt(x, y)) / 0.8) ** 2))) *
        (1 + 0.3 * truth.noise(x, candidate))
    );
  });
  const mapping = Array.from({ length: COLUMNS }, (_, x) =>
    truth.codeAt(x, y) === 0 ? truth.disparityAt(x, y) : null,
  );
  return [{ rows, columns: COLUMNS, y, first_px: 16, step_px: 0.1, mapping }, values];
}

export function line(query: URLSearchParams): LineInfo {
  const [x0, y0, x1, y1] = ['x0', 'y0', 'x1', 'y1'].map((name) => Number(query.get(name))) as [
    number,
    number,
    number,
    number,
  ];
  const at = levelledAt(query.get('levelled_by'));
  const steps = Math.max(Math.round(Math.hypot(x1 - x0, y1 - y0)), 1);
  const points = Array.from({ length: steps + 1 }, (_, index) => {
    const share = index / steps;
    const [x, y] = [x0 + (x1 - x0) * share, y0 + (y1 - y0) * share];
    const [column, row] = [Math.round(x), Math.round(y)];
    const found = truth.codeAt(column, row) === 0;
    return {
      x_px: x,
      y_px: y,
      distance_mm: index * PIXEL_MM,
      height_mm: found ? at(column, row) : null,
      sigma_mm: found ? truth.sigmaMmAt(column, row) : null,
    };
  });
  return { unit: 'mm', points };
}

export function lineCsv(info: LineInfo): string {
  const rows = info.points.map((point) =>
    [point.x_px, point.y_px, point.distance_mm, point.height_mm ?? 'nan', point.sigma_mm ?? 'nan'].join(
      ',',
    ),
  );
  return `x_px,y_px,distance_mm,height_mm,sigma_mm\n${rows.join('\n')}\n`;
}

export function mesh(by: string | null): [object, Float32Array] {
  const at = levelledAt(by);
  const step = 2;
  const [rows, columns] = [ROWS / step, COLUMNS / step];
  const size = rows * columns;
  const values = Float32Array.from({ length: 2 * size }, (_, index) => {
    const [x, y] = [((index % size) % columns) * step, Math.floor((index % size) / columns) * step];
    if (index >= size) return truth.frameAt(REFERENCE, x, y) / 4095;
    return truth.codeAt(x, y) === 0 ? at(x, y) : NaN;
  });
  const head = {
    rows,
    columns,
    step,
    pixel_mm: PIXEL_MM,
    low_mm: -0.23,
    high_mm: 0.03,
    distance_mm: 300,
  };
  return [head, values];
}

export function compare(): [object, Float32Array] {
  const step = 2;
  const [rows, columns] = [ROWS / step, COLUMNS / step];
  const size = rows * columns;
  const values = Float32Array.from({ length: 2 * size }, (_, index) => {
    const [x, y] = [((index % size) % columns) * step, Math.floor((index % size) / columns) * step];
    if (truth.codeAt(x, y) !== 0) return NaN;
    const difference = 0.002 * truth.noise(x + 7, y + 3) + 0.003 * Math.sin(x / 90);
    return index < size ? difference : difference / (truth.sigmaMmAt(x, y) * Math.SQRT2);
  });
  const head = {
    rows,
    columns,
    step,
    unit: 'mm',
    count: 289000,
    mean: 0.00012,
    standard_deviation: 0.0024,
    median: 0.0001,
    in_sigma: { one: 0.66, two: 0.94 },
    scan: null,
  };
  return [head, values];
}

export function stage(): StageInfo {
  return {
    frames: TAU.map((_, index) => ({
      index,
      planned_mm: index * 0.5,
      reported_mm: index * 0.5 + 0.0004 * truth.noise(index, 1),
      error_um: 0.4 * truth.noise(index, 1),
      measured_error_px: 0.004 * truth.noise(index, 2),
      retakes: index === 11 ? 1 : 0,
      mean_dn: 1200,
      saturated: 0,
    })),
    retakes: [
      { frame: 11, attempt: 1, at: '14:01:02', reason: 'shake: the image moved by 0.6 px (limit 0.2 px)' },
      { frame: 29, attempt: 1, at: '14:02:11', reason: 'light: the mean fell by 4.1 % (limit 2 %)' },
    ],
    events: [{ at: '14:02:11', words: 'frame 29 retaken' }],
  };
}
