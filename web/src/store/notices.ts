// Short words to the person: what was done, and what was refused.

import { signal } from '@preact/signals';

export interface Notice {
  kind: 'done' | 'refused';
  words: string;
  /** The field or button that it is about; null if there is none on the screen. */
  at: Element | null;
}

export const notice = signal<Notice | null>(null);

/** A refusal stays longer: it is to be read, and something is to be done about it. */
const STAYS_MS = { done: 4000, refused: 12_000 };

let timer: ReturnType<typeof setTimeout> | undefined;

function tell(told: Notice): void {
  notice.value = told;
  clearTimeout(timer);
  timer = setTimeout(() => (notice.value = null), STAYS_MS[told.kind]);
}

/** Tells what was done, for example "Link copied". */
export function say(words: string): void {
  tell({ kind: 'done', words, at: null });
}

/** The field or button that was used last. Some browsers do not focus a button that is clicked. */
let used: Element | null = null;

/** A field that is left is still what its number comes from. */
export function markUsed(element: Element): void {
  used = element;
}

/** Follows which field or button is used; a refusal that was read goes with the next use of any. */
export function followUse(): void {
  const uses = (event: Event): void => {
    const target = event.target instanceof Element ? event.target : null;
    used = target?.closest('button, input, select, textarea, a, summary, canvas') ?? null;
    if (event.type !== 'focusin' && notice.peek()?.kind === 'refused') notice.value = null;
  };
  for (const name of ['pointerdown', 'focusin', 'keydown']) addEventListener(name, uses, { capture: true });
}

/** What used a moment ago is what an order comes from; to be asked before the order is sent. */
export function usedLast(): Element | null {
  return used;
}

/** Tells what was refused, beside the field or button it came from. */
export function refuse(fault: unknown, at: Element | null = usedLast()): void {
  const words = fault instanceof Error ? fault.message : String(fault);
  tell({ kind: 'refused', words, at: at?.isConnected ? at : null });
}
