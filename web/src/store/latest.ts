// Questions to the server of which only the newest counts, such as "what is at the pin" while the pin moves.

import { signal, type Signal } from '@preact/signals';

export interface Answered<K, T> {
  /** What was asked; null if nothing is. */
  key: K | null;
  /** The newest answer; while another is on its way, the one before. */
  value: T | null;
  /** The key that `value` answers. */
  of: K | null;
  loading: boolean;
  error: string | null;
}

export interface Latest<K, T> {
  state: Signal<Answered<K, T>>;
  ask: (key: K | null) => void;
}

/** Asks at most every `pause` ms; stops and drops older questions. */
export function latest<K, T>(
  question: (key: K, signal: AbortSignal) => Promise<T>,
  pause = 100,
): Latest<K, T> {
  const nothing: Answered<K, T> = { key: null, value: null, of: null, loading: false, error: null };
  const state = signal(nothing);
  let running: AbortController | undefined;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let lastAsked = 0;

  async function begin(key: K): Promise<void> {
    lastAsked = Date.now();
    const mine = new AbortController();
    running = mine;
    try {
      const value = await question(key, mine.signal);
      if (running === mine) state.value = { key, value, of: key, loading: false, error: null };
    } catch (error) {
      if (running !== mine) return;
      const message = error instanceof Error ? error.message : String(error);
      state.value = { ...state.peek(), loading: false, error: message };
    }
  }

  function ask(key: K | null): void {
    running?.abort();
    running = undefined;
    clearTimeout(timer);
    if (key === null) {
      state.value = nothing;
      return;
    }
    state.value = { ...state.peek(), key, loading: true, error: null };
    timer = setTimeout(() => void begin(key), Math.max(0, lastAsked + pause - Date.now()));
  }

  return { state, ask };
}
