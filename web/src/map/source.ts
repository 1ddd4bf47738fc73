// Where tiles come from: a map or a frame on the server, or an array in the page.

import { api } from '../api';
import { results } from '../store/results';
import { TILE } from './pyramid';

/** Stands for "no data" in tiles, since not every GPU keeps a NaN. */
export const NO_DATA = -3e38;
/** Stands for "not here yet" in textures. */
export const NOT_LOADED = -2e38;

export interface TileSource {
  /** Names the source in the cache. */
  key: string;
  levels: number;
  /** Sources of one group may stand in for each other while tiles are on their way, as frames do. */
  group?: string;
  /** Image px per value of level 0; 1 for maps and frames. */
  step: number;
  load: (level: number, row: number, column: number, abort: AbortSignal) => Promise<Float32Array>;
}

function marked(values: Float32Array): Float32Array {
  for (let index = 0; index < values.length; index += 1) {
    const value = values[index] as number;
    if (!Number.isFinite(value)) values[index] = NO_DATA;
  }
  return values;
}

/** Names the results, so that tiles of former ones are not taken for theirs. */
const ofResults = (): string => results.value?.id ?? '';

/** `by` is what a map of heights is levelled by. */
export function mapSource(id: string, levels: number, by: string | null = null): TileSource {
  return {
    key: `${ofResults()}/map/${id}/${by ?? ''}`,
    levels,
    step: 1,
    load: async (level, row, column, abort) =>
      marked(
        await api.tile(
          `api/maps/${encodeURIComponent(id)}/${level}/${row}/${column}${by ? `?levelled_by=${by}` : ''}`,
          abort,
        ),
      ),
  };
}

export function frameSource(frame: number, kind: string, levels: number): TileSource {
  return {
    key: `${ofResults()}/frame/${kind}/${frame}`,
    group: `${ofResults()}/frame/${kind}`,
    levels,
    step: 1,
    load: async (level, row, column, abort) =>
      marked(await api.tile(`api/frames/${frame}/${level}/${row}/${column}?kind=${kind}`, abort)),
  };
}

/** An array of `columns` values a row, each of which stands for `step` x `step` px. */
export function arraySource(key: string, values: Float32Array, columns: number, step: number): TileSource {
  const rows = values.length / columns;
  const load = (_level: number, row: number, column: number): Promise<Float32Array> => {
    const tile = new Float32Array(TILE * TILE).fill(NO_DATA);
    const width = Math.min(TILE, columns - column * TILE);
    for (let y = 0; y < Math.min(TILE, rows - row * TILE); y += 1) {
      const start = (row * TILE + y) * columns + column * TILE;
      tile.set(values.subarray(start, start + width), y * TILE);
    }
    return Promise.resolve(marked(tile));
  };
  return { key, levels: 1, step, load };
}
