// A small rig of the test's own: it holds a state, records orders, and serves maps whose values are known.

import type { Page, WebSocketRoute } from '@playwright/test';
import type { LiveMapHead, ProfileMistake, RigState } from '../../src/rig/api';
import { idle, PLAN, PROFILE, SEQUENCES } from './fake_states';
import { watchRequests } from './quiet';
import { servePage, SITE } from './views_page';

export const ROWS = 48;
export const COLUMNS = 64;
export const BIN = 8;

/** Disparity in px of a cell: blocks of 8 cells, each with its own value; NaN in the lower right corner. */
export function disparityOf(row: number, column: number): number {
  if (row >= 40 && column >= 56) return NaN;
  return 20 + 0.1 * Math.floor(column / 8) + 0.02 * Math.floor(row / 8);
}

/** Sigma in px after so many frames: it falls with the frames. */
export function sigmaOf(row: number, column: number, frames: number): number {
  return Number.isNaN(disparityOf(row, column)) ? NaN : (0.2 / frames) * (1 + Math.floor(column / 16));
}

type Order = { path: string; asked: Record<string, unknown> };

/** A record and values, as the server sends them. */
function framedBytes(head: object, values: Uint8Array): Buffer {
  let text = JSON.stringify(head);
  while (text.length % 4 !== 0) text += ' ';
  const length = Buffer.alloc(4);
  length.writeUInt32LE(text.length);
  return Buffer.concat([length, Buffer.from(text), values]);
}

function picture(): Buffer {
  const [rows, columns] = [192, 256];
  const head = {
    number: 1,
    x: 0,
    y: 0,
    bin: 2,
    rows,
    columns,
    frame_rows: rows * 2,
    frame_columns: columns * 2,
    age_ms: 40,
  };
  const samples = Uint8Array.from({ length: rows * columns }, (_, index) => {
    const [row, column] = [Math.floor(index / columns), index % columns];
    return 60 + 120 * ((Math.floor(row / 24) + Math.floor(column / 24)) % 2) + (column / columns) * 60;
  });
  return framedBytes(head, samples);
}

export class FakeRig {
  state: RigState = idle();
  orders: Order[] = [];
  /** Words with which an order of a path is refused. */
  refusals: Record<string, string> = {};
  plan = structuredClone(PLAN);
  sequences = structuredClone(SEQUENCES);
  profile = structuredClone(PROFILE);
  /** What the check of the profile finds. */
  check: (values: Record<string, string>) => ProfileMistake[] = () => [];
  /** Range of the maps; the fake's server would find 0.5 to 99.5 %. */
  range = { disparity: [20, 20.8], sigma: [0.005, 0.02] };
  mapsAsked: string[] = [];
  wishes: object[] = [];
  private sockets = new Set<WebSocketRoute>();

  constructor(private readonly page: Page) {}

  async open(view: 'scan' | 'profile' = 'scan', token = 'secret'): Promise<void> {
    watchRequests(this.page);
    await servePage(this.page);
    await this.page.route(`${SITE}/api/**`, async (route) => {
      const request = route.request();
      const address = new URL(request.url());
      const path = address.pathname.slice('/api/'.length);
      if (request.method() === 'POST') {
        const asked = request.postDataJSON() as Record<string, unknown>;
        if (path !== 'rig/hello') this.orders.push({ path, asked });
        const refused =
          this.refusals[path] ?? (request.headers()['x-epirig-token'] ? null : 'The token is missing.');
        if (refused !== null) {
          await route.fulfill({ status: 400, json: { error: { message: refused } } });
          return;
        }
        await route.fulfill({ json: this.answer(path, asked) });
        return;
      }
      if (path === 'scan/map') {
        await route.fulfill({ body: this.map(address.searchParams.get('kind')!) });
        return;
      }
      const found = { 'scan/plan': this.plan, sequences: this.sequences, 'rig/profile': this.profile }[
        path
      ];
      await route.fulfill(
        found ? { json: found } : { status: 404, json: { error: { message: `there is no ${path}` } } },
      );
    });
    await this.page.routeWebSocket(/\/api\/rig\/state/, (socket) => {
      this.sockets.add(socket);
      socket.onClose(() => void this.sockets.delete(socket));
      socket.send(JSON.stringify(this.state));
    });
    await this.page.routeWebSocket(/\/api\/rig\/picture/, (socket) => {
      socket.onMessage((message) => {
        if (message === 'ok') return;
        this.wishes.push(JSON.parse(String(message)) as object);
        socket.send(picture());
      });
    });
    await this.page.goto(`${SITE}/?view=${view}${token ? `#token=${token}` : ''}`);
  }

  /** Makes it the state, and tells it to the page. */
  set(state: RigState): void {
    this.state = state;
    for (const socket of this.sockets) socket.send(JSON.stringify(state));
  }

  /** Waits until all that the page has asked up to now is here. */
  async heard(): Promise<void> {
    await this.page.evaluate(() => fetch('/api/sequences'));
  }

  private answer(path: string, asked: Record<string, unknown>): unknown {
    if (path === 'rig/profile/check') return this.check(asked.values as Record<string, string>);
    if (path === 'rig/profile/save') return { file: this.profile.file };
    return null;
  }

  private map(kind: string): Buffer {
    this.mapsAsked.push(kind);
    const frames = this.state.scan?.map?.frames ?? 0;
    const values = Float32Array.from({ length: ROWS * COLUMNS }, (_, index) => {
      const [row, column] = [Math.floor(index / COLUMNS), index % COLUMNS];
      return kind === 'sigma' ? sigmaOf(row, column, frames) : disparityOf(row, column);
    });
    const [low, high] = this.range[kind as 'disparity' | 'sigma'];
    const head: LiveMapHead = {
      rows: ROWS,
      columns: COLUMNS,
      bin: BIN,
      frames,
      planned: this.state.scan?.planned ?? 0,
      unit: 'px',
      low: low!,
      high: high!,
    };
    return framedBytes(head, new Uint8Array(values.buffer));
  }

  /** The orders of a path. */
  asked(path: string): Record<string, unknown>[] {
    return this.orders.filter((order) => order.path === path).map(({ asked }) => asked);
  }
}
