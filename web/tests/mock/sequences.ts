// Sequences of the mock server: a tile that was scanned again and again, and whose depth has changed once.

import { crc32, deflateSync } from 'node:zlib';
import type { SequenceEntry, SeriesTrend, TrendQuestion } from '../../src/api';
import { noise } from './truth';

const SCATTER_MM = 0.0004;
const CHANGE_MM = 0.0008;

/** Every tenth was not measured, and every fiftieth cannot be read. */
function entry(number: number, count: number): SequenceEntry {
  const begun = new Date(Date.UTC(2026, 8, 1, 8) + number * 1_800_000).toISOString();
  const broken = number % 50 === 49;
  const unmeasured = number % 10 === 4;
  const depth_mm =
    0.2 +
    SCATTER_MM * noise(number, 5) +
    (number >= 0.6 * count ? CHANGE_MM : 0) +
    (number === 7 ? 0.004 : 0);
  const measured = !broken && !unmeasured;
  const verdict = depth_mm > 0.203 ? 'fail' : depth_mm > 0.2013 ? 'undecided' : 'pass';
  return {
    name: `${number < count / 2 ? 'monday' : 'friday'}/tile-${String(number).padStart(4, '0')}`,
    created: broken ? '' : begun,
    state: broken ? 'unreadable' : measured ? 'measured' : number % 20 === 4 ? 'scan' : 'calibrated',
    ended: broken ? '' : 'complete',
    frames: broken ? 0 : 101,
    planned: broken ? 0 : 101,
    can_be_resumed: false,
    depth_mm: measured ? depth_mm : null,
    half_width_95_mm: measured ? 0.0018 : null,
    verdict: measured ? verdict : null,
    problem: broken ? 'sequence.json is no record: line 1; restore it from a copy' : null,
    picture: broken ? null : `picture-${number}`,
  };
}

/** So many sequences, the newest first. */
export function sequenceList(count: number): SequenceEntry[] {
  return Array.from({ length: count }, (_, index) => entry(count - 1 - index, count));
}

/** The list of the server. */
export const SEQUENCES = sequenceList(60);

const mean = (values: number[]): number => values.reduce((sum, one) => sum + one, 0) / values.length;

/** The chart of the depths of `list`; the other quantities are offered, and have none. */
export function trendOf({ measure, sequences }: TrendQuestion, list: SequenceEntry[]): SeriesTrend {
  const wanted = new Set(sequences);
  const there = list.filter(({ name, depth_mm }) => wanted.has(name) && depth_mm !== null).reverse();
  const values = there.map(({ depth_mm }) => depth_mm!);
  const offered: SeriesTrend['offered'] =
    values.length < 2
      ? []
      : [
          { measure: 'depth', meaning: 'Depth of the hollows, or height of the raised parts.' },
          { measure: 'noise', meaning: 'Standard uncertainty of a typical disparity, by the noise.' },
        ];
  if (values.length < 2 || measure !== 'depth') return { offered, chart: null, problems: [] };
  const ranges = values.slice(1).map((value, index) => Math.abs(value - values[index]!));
  const scatter = mean(ranges) / 1.128;
  const centre = mean(values);
  const [lower, upper] = [centre - 3 * scatter, centre + 3 * scatter];
  const first = Math.ceil(0.6 * values.length);
  return {
    offered,
    chart: {
      measure,
      unit: 'mm',
      points: there.map(({ name, created }, index) => ({
        sequence: name,
        begun: created,
        value: values[index]!,
        sigma: 0.0006,
        rules: [
          ...(values[index]! < lower || values[index]! > upper ? ['beyond three standard deviations'] : []),
          ...((ranges[index - 1] ?? 0) > 3.267 * mean(ranges) ? ['too far from the one before'] : []),
        ],
      })),
      mean: centre,
      lower,
      upper,
      scatter,
      change: {
        first,
        earliest: first - 2,
        latest: first + 1,
        before: mean(values.slice(0, first)),
        after: mean(values.slice(first)),
      },
      lower_limit: 0.19,
      upper_limit: 0.203,
    },
    problems: [],
  };
}

function chunk(name: string, bytes: Buffer): Buffer {
  const body = Buffer.concat([Buffer.from(name, 'latin1'), bytes]);
  const [length, sum] = [Buffer.alloc(4), Buffer.alloc(4)];
  length.writeUInt32BE(bytes.length);
  sum.writeUInt32BE(crc32(body));
  return Buffer.concat([length, body, sum]);
}

/** A picture with one hollow, whose place tells its number. */
export function pictureOf(name: string): Buffer {
  const [rows, columns] = [72, 96];
  const number = Number(/\d+$/.exec(name)?.[0] ?? 0);
  const [x0, y0] = [20 + (number % 7) * 8, 14 + (number % 5) * 8];
  const lines = Array.from({ length: rows }, (_, y) => {
    const line = Buffer.alloc(1 + 3 * columns);
    for (let x = 0; x < columns; x += 1) {
      const low = x >= x0 && x < x0 + 24 && y >= y0 && y < y0 + 24;
      line.set(low ? [68, 1, 84] : [122, 209, 81], 1 + 3 * x);
    }
    return line;
  });
  const head = Buffer.alloc(13);
  head.writeUInt32BE(columns, 0);
  head.writeUInt32BE(rows, 4);
  head.set([8, 2], 8);
  return Buffer.concat([
    Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]),
    chunk('IHDR', head),
    chunk('IDAT', deflateSync(Buffer.concat(lines))),
    chunk('IEND', Buffer.alloc(0)),
  ]);
}
