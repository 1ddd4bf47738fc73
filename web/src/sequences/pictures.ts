// Small pictures of sequences: asked for when they come on the screen, and kept by the browser.

import { rig } from '../rig/api';

/** Pictures that are asked for at the same time: a browser has six connections, and STOP needs one. */
const MOST = 2;

interface Wish {
  name: string;
  signal: AbortSignal;
  done: (picture: Blob | null) => void;
}

const waiting: Wish[] = [];
let asked = 0;

function next(): void {
  while (asked < MOST) {
    const wish = waiting.shift();
    if (!wish) return;
    if (wish.signal.aborted) continue;
    asked += 1;
    rig
      .picture(wish.name, wish.signal)
      .then(wish.done, () => wish.done(null))
      .finally(() => {
        asked -= 1;
        next();
      });
  }
}

/** A picture by its name; null if there is none. Nobody is told after `signal`. */
export function pictureOf(name: string, signal: AbortSignal): Promise<Blob | null> {
  return new Promise((done) => {
    waiting.push({ name, signal, done });
    next();
  });
}
