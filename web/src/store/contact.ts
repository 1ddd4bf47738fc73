// Whether the server answers. Results stay readable without it, so a lost server is a state, not an error.

import { signal } from '@preact/signals';

/** When the server was last heard, if the last request found nobody; null while all is well. */
export const lostSince = signal<number | null>(null);

let lastHeard = Date.now();

export function contactMade(): void {
  lastHeard = Date.now();
  if (lostSince.peek() !== null) lostSince.value = null;
}

export function contactFailed(): void {
  if (lostSince.peek() === null) lostSince.value = lastHeard;
}

/** Asks the server now and then whether it is there: often while it is lost. */
export function watchContact(ask: () => Promise<unknown>): void {
  const again = async (): Promise<void> => {
    const rest = lostSince.peek() === null ? 5000 : 2000;
    await new Promise((resolve) => setTimeout(resolve, rest));
    if (document.visibilityState === 'visible') await ask().catch(() => undefined);
    void again();
  };
  void again();
}
