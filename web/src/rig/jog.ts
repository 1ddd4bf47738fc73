// Hold-to-move. The stage moves only as long as a person holds a button, and this page says so every 100 ms;
// the server stops it 300 ms after the last word. Whatever ends a hold ends it for good: it never begins
// again by itself.

export interface JogOrders {
  jog: (id: number, direction: 1 | -1, fast: boolean) => Promise<unknown>;
  keep: (id: number) => Promise<unknown>;
  release: (id: number) => Promise<unknown>;
}

export interface Clock {
  now: () => number;
  every: (ms: number, act: () => void) => () => void;
}

export interface Held {
  id: number;
  direction: 1 | -1;
  fast: boolean;
}

export const KEEP_MS = 100;
/**
 * After such a gap the page was frozen, and going on would be a new start. The server has long stopped the
 * stage by then: it needs no more than 300 ms, and refuses to go on after that.
 */
const GAP_MS = 1000;

const CLOCK: Clock = {
  now: () => performance.now(),
  every: (ms, act) => {
    const timer = setInterval(act, ms);
    return () => clearInterval(timer);
  },
};

export class Jog {
  private held: Held | null = null;
  private answered = false;
  private lastTick = 0;
  private stopClock: () => void = () => undefined;
  private nextId = Math.floor(Math.random() * 2 ** 30);

  /**
   * `allowed` is asked before each word to the server; `changed` tells what is held; `failed` gets the
   * server's refusal.
   */
  constructor(
    private readonly orders: JogOrders,
    private readonly allowed: () => boolean,
    private readonly changed: (held: Held | null) => void,
    private readonly failed: (fault: unknown) => void,
    private readonly clock: Clock = CLOCK,
  ) {}

  /** Begins to move. A second hold ends the first and begins nothing: two fingers contradict each other. */
  hold(direction: 1 | -1, fast: boolean): void {
    if (this.held) {
      this.end();
      return;
    }
    if (!this.allowed()) return;
    const held = { id: (this.nextId += 1), direction, fast };
    this.held = held;
    this.answered = false;
    this.lastTick = this.clock.now();
    this.stopClock = this.clock.every(KEEP_MS, () => this.tick());
    this.changed(held);
    this.orders.jog(held.id, direction, fast).then(
      () => this.begun(held),
      (fault: unknown) => this.refused(held, fault),
    );
  }

  /** Ends the hold, if there is one. */
  end(): void {
    const { held } = this;
    if (!held) return;
    this.held = null;
    this.stopClock();
    this.changed(null);
    this.release(held.id);
  }

  private begun(held: Held): void {
    // Requests may overtake each other: a release that came before its jog has done nothing.
    if (this.held !== held) this.release(held.id);
    else this.answered = true;
  }

  private tick(): void {
    const { held } = this;
    if (!held) return;
    const now = this.clock.now();
    const gap = now - this.lastTick;
    this.lastTick = now;
    if (gap > GAP_MS || !this.allowed()) {
      this.end();
      return;
    }
    // Before the answer a word could overtake the jog itself.
    if (this.answered) this.orders.keep(held.id).catch((fault: unknown) => this.refused(held, fault));
  }

  private refused(held: Held, fault: unknown): void {
    if (this.held !== held) return;
    this.end();
    this.failed(fault);
  }

  private release(id: number): void {
    // Without it the stage stops by itself, a little later.
    this.orders.release(id).catch(() => undefined);
  }
}
