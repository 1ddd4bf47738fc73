// A rig that is not there: it answers the page's orders, records them, tells its state and sends pictures.

import { expect, type Page, type WebSocketRoute } from '@playwright/test';
import type { Control, RigState, SequenceEntry } from '../../src/rig/api';
import { ORIGIN, SECRET } from './page';
import { FRAME, pictureOf, type Wish } from './picture';
import { drawn, watchRequests } from './quiet';

export interface Order {
  path: string;
  asked: Record<string, unknown>;
}

export function startState(): RigState {
  const histogram = Array.from({ length: 256 }, (_, bin) =>
    Math.round(4000 * Math.exp(-(((bin - 110) / 40) ** 2)) + (bin === 255 ? 60 : 0)),
  );
  return {
    rig: 'bench-2',
    task: null,
    stopping: false,
    camera: {
      state: 'live',
      name: 'sim-camera',
      error: null,
      simulated: true,
      ...FRAME,
      bit_depth: 12,
      exposure_us: 8000,
      rate_hz: 25,
      picture_hz: 24.8,
    },
    light: {
      mean_dn: 1810,
      minimum_dn: 4,
      maximum_dn: 4095,
      full_scale_dn: 4095,
      pixels: FRAME.rows * FRAME.columns,
      saturated: 60,
      black: 307,
      focus: 0.713,
      focus_peak: 0.741,
      corners: 0.69,
      bin_width_dn: 16,
      histogram,
    },
    target: null,
    stage: {
      state: 'ready',
      name: 'sim-stage',
      error: null,
      simulated: true,
      position_mm: 12.345,
      homed: true,
      moving: false,
      at_limit: false,
      travel_mm: 100,
      plan_mm: [10, 60],
      steps_mm: [0.01, 0.1, 1],
      runs_on_mm: [0.3, 3],
    },
    doctor: null,
    scan: null,
    log: [
      { number: 1, at: '14:01:07', kind: 'note', words: 'camera connected: sim-camera, 640 x 480, 12 bit' },
      { number: 2, at: '14:01:08', kind: 'note', words: 'stage connected: sim-stage, travel 100 mm' },
      { number: 3, at: '14:02:11', kind: 'warning', words: 'mean light fell 4.1 % (limit 2 %)' },
    ],
    controller: null,
    free_bytes: 412e9,
  };
}

function control(name: string, kind: Control['kind'], more: Partial<Control> = {}): Control {
  return {
    name,
    kind,
    minimum: 0,
    maximum: 100,
    step: 1,
    default: 0,
    value: 0,
    read_only: false,
    inactive: false,
    items: [],
    ...more,
  };
}

export function startControls(): Control[] {
  return [
    control('brightness', 'integer', { minimum: -64, maximum: 64, value: 4 }),
    control('gain', 'integer', { value: 10 }),
    control('auto_exposure', 'menu', {
      maximum: 3,
      value: 1,
      items: [
        [1, 'Manual Mode'],
        [3, 'Aperture Priority Mode'],
      ],
    }),
    control('exposure_time_absolute', 'integer', { minimum: 1, maximum: 200, value: 80 }),
    control('gamma', 'integer', { value: 100, read_only: true }),
    control('flip', 'boolean', { maximum: 1, value: 0 }),
    control('save_as_default', 'button'),
  ];
}

export interface Options {
  token?: boolean;
  sequence?: string | null;
}

export class FakeRig {
  state = startState();
  controls = startControls();
  sequences: SequenceEntry[] = [entry('set-0411', false), entry('mock-0042', true)];
  orders: Order[] = [];
  /** Orders that were refused for want of a token. */
  refused: string[] = [];
  /** Why all orders are refused, if they are. */
  refusal: string | null = null;
  wishes: Wish[] = [];
  /** While true no pictures are sent. */
  frozen = false;
  /** Time between two pictures, if the page takes them so fast. */
  picture_ms = 60;
  /** Requests are not answered. */
  unreachable = false;
  openPictures = 0;
  sequence: string | null;
  private readonly token: boolean;
  /** Connections for the state, with the number of states that the page has not acknowledged. */
  private states = new Map<WebSocketRoute, number>();
  private number = 0;

  constructor(
    private readonly page: Page,
    options: Options = {},
  ) {
    this.token = options.token ?? true;
    this.sequence = options.sequence === undefined ? 'mock-0042' : options.sequence;
  }

  /** The orders to one path. */
  sent(path: string): Order[] {
    return this.orders.filter((order) => order.path === path);
  }

  /** Tells the page a new state. */
  tell(change: Partial<RigState>): void {
    this.state = { ...this.state, ...change };
    for (const socket of this.states.keys()) this.send(socket);
  }

  private send(socket: WebSocketRoute): void {
    this.states.set(socket, (this.states.get(socket) ?? 0) + 1);
    socket.send(JSON.stringify(this.state));
  }

  /** Waits until the page has drawn the last state that it was told. */
  async shown(): Promise<void> {
    await expect.poll(() => [...this.states.values()], { intervals: [20, 50, 100] }).toEqual([0]);
    await drawn(this.page);
  }

  /** Waits until all orders that the page has sent up to now are here. */
  async heard(): Promise<void> {
    await this.page.evaluate(() => fetch('/api/sequences'));
  }

  /** Closes all connections and takes no more. */
  async vanish(): Promise<void> {
    this.unreachable = true;
    for (const socket of this.states.keys()) await socket.close();
  }

  async install(): Promise<void> {
    await this.page.route('**/api/about', async (route) => {
      if (this.unreachable) return route.abort();
      const address = `${ORIGIN}/api/about?mode=ui&sequence=${this.sequence ?? ''}`;
      const reply = await fetch(address, { headers: { 'x-epirig-token': SECRET } });
      // Unlike `route.fetch` this does not fail the next test if this one has ended meanwhile.
      return route.fulfill({ status: reply.status, json: await reply.json() }).catch(() => undefined);
    });
    // What is asked about sequences is known by the mock server. Whoever looks may ask it.
    await this.page.route(/\/api\/sequences\/./, async (route) => {
      if (this.unreachable) return route.abort();
      const request = route.request();
      const headers = { 'x-epirig-token': SECRET };
      const body = request.postData();
      const reply = await fetch(request.url(), { method: request.method(), headers, body });
      return route
        .fulfill({ status: reply.status, body: Buffer.from(await reply.arrayBuffer()) })
        .catch(() => undefined);
    });
    await this.page.route(/\/api\/((rig|scan|results\/open)(\/|$)|sequences$)/, async (route) => {
      if (this.unreachable) return route.abort();
      const request = route.request();
      const path = new URL(request.url()).pathname.replace('/api/', '');
      if (request.method() === 'GET') return route.fulfill({ json: this.answer(path) });
      const asked = request.postDataJSON() as Record<string, unknown>;
      if (!this.token && path !== 'rig/stop') {
        this.refused.push(path);
        return route.fulfill({ status: 401, json: { error: { message: 'The token is missing.' } } });
      }
      this.orders.push({ path, asked });
      if (this.refusal !== null) {
        return route.fulfill({ status: 400, json: { error: { message: this.refusal } } });
      }
      return route.fulfill({ json: this.obey(path, asked) });
    });
    await this.page.routeWebSocket(/\/api\/rig\/state/, (socket) => {
      if (this.unreachable) return void socket.close();
      this.send(socket);
      socket.onMessage(() => void this.states.set(socket, this.states.get(socket)! - 1));
      socket.onClose(() => void this.states.delete(socket));
    });
    await this.page.routeWebSocket(/\/api\/rig\/picture/, (socket) => {
      if (this.unreachable) return void socket.close();
      this.openPictures += 1;
      let wish: Wish | null = null;
      // As the server does it: the next picture waits until the page has taken the one before.
      let taken = true;
      let timer: ReturnType<typeof setTimeout> | undefined;
      const next = (): void => {
        if (wish && taken && !this.frozen) {
          this.number += 1;
          taken = false;
          socket.send(pictureOf(wish, this.number));
        }
        timer = setTimeout(next, this.picture_ms);
      };
      next();
      socket.onMessage((message) => {
        if (message === 'ok') taken = true;
        if (message === 'ok' || typeof message !== 'string') return;
        wish = JSON.parse(message) as Wish;
        this.wishes.push(wish);
      });
      socket.onClose(() => {
        clearTimeout(timer);
        this.openPictures -= 1;
      });
    });
  }

  /** Opens the page; with no token if there is none. */
  async open(hash = ''): Promise<void> {
    watchRequests(this.page);
    await this.install();
    const parts = [hash, this.token ? `token=${SECRET}` : ''].filter(Boolean);
    const joint = hash.includes('?') || !hash ? '&' : '?';
    await this.page.goto(`${ORIGIN}/#${parts.join(joint)}`);
    await expect(this.page.getByRole('navigation', { name: 'Views' })).toContainText('Rig');
    if (this.token) await expect(this.page.locator('.who')).not.toContainText('connecting');
  }

  private answer(path: string): unknown {
    if (path === 'rig/controls') return this.controls;
    if (path === 'sequences') return this.sequences;
    return null;
  }

  private obey(path: string, asked: Record<string, unknown>): unknown {
    if (path === 'rig/take') this.tell({ controller: String(asked.client) });
    if (path === 'rig/control') {
      this.controls = this.controls.map((one) =>
        one.name === asked.name ? { ...one, value: Number(asked.value) } : one,
      );
      return this.controls;
    }
    if (path === 'results/open') this.sequence = String(asked.name);
    return null;
  }
}

function entry(name: string, measured: boolean): SequenceEntry {
  return {
    name,
    created: '2026-11-20 14:02',
    frames: 101,
    planned: 101,
    ended: 'complete',
    can_be_resumed: false,
    state: measured ? 'measured' : 'scan',
    depth_mm: measured ? 0.2 : null,
    half_width_95_mm: measured ? 0.0079 : null,
    verdict: measured ? 'pass' : null,
    problem: null,
    picture: null,
  };
}
