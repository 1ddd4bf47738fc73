// The tiles that are in the page: a cache of fixed size, and a queue that asks for what the screen wants now.

import type { TileSource } from './source';

export interface TileName {
  source: TileSource;
  level: number;
  row: number;
  column: number;
}

/** 160 tiles of 256 KiB are 40 MiB. */
const MOST_TILES = 160;
const MOST_REQUESTS = 6;
const RETRY_MS = 2000;

function keyOf({ source, level, row, column }: TileName): string {
  return `${source.key}/${level}/${row}/${column}`;
}

export class Tiles {
  private readonly ready = new Map<string, Float32Array>();
  private readonly running = new Map<string, AbortController>();
  private readonly failed = new Map<string, number>();
  private wanted: TileName[] = [];

  constructor(private readonly arrived: () => void) {}

  get(name: TileName): Float32Array | null {
    const key = keyOf(name);
    const tile = this.ready.get(key);
    if (!tile) return null;
    // Last used is last in the map, so the first is dropped first.
    this.ready.delete(key);
    this.ready.set(key, tile);
    return tile;
  }

  /** Says which tiles the screen wants, the most wanted first. What else was waiting is forgotten. */
  want(names: TileName[]): void {
    this.wanted = names;
    const keys = new Set(names.map(keyOf));
    for (const [key, request] of this.running) if (!keys.has(key)) request.abort();
    this.pump();
  }

  private pump(): void {
    for (const name of this.wanted) {
      if (this.running.size >= MOST_REQUESTS) return;
      const key = keyOf(name);
      const resting = (this.failed.get(key) ?? 0) > Date.now() - RETRY_MS;
      if (!this.ready.has(key) && !this.running.has(key) && !resting) void this.load(name, key);
    }
  }

  private async load(name: TileName, key: string): Promise<void> {
    const request = new AbortController();
    this.running.set(key, request);
    try {
      const tile = await name.source.load(name.level, name.row, name.column, request.signal);
      this.ready.set(key, tile);
      this.failed.delete(key);
      for (const old of this.ready.keys()) {
        if (this.ready.size <= MOST_TILES) break;
        this.ready.delete(old);
      }
      this.arrived();
    } catch {
      if (!request.signal.aborted) {
        this.failed.set(key, Date.now());
        setTimeout(() => this.pump(), RETRY_MS + 50);
      }
    }
    this.running.delete(key);
    this.pump();
  }
}
