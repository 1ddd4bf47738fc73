import type { ComponentChildren } from 'preact';
import { onlyWatches } from './store';

interface Props {
  act: () => void;
  /** Why it would be refused; null if it would not. */
  why: string | null;
  /** What is read out, if it is not what is shown. */
  name?: string;
  pressed?: boolean;
  kind?: string;
  children: ComponentChildren;
}

/**
 * A button of the rig. While it is off it keeps the focus and says why, so that keys can go on after. A page that
 * only watches has none.
 */
export function OrderButton({ act, why, name, pressed, kind, children }: Props) {
  if (onlyWatches.value) return null;
  return (
    <button
      type="button"
      class={kind}
      aria-label={name}
      aria-pressed={pressed}
      aria-disabled={why !== null}
      title={why === null ? undefined : `Off: ${why}`}
      onClick={() => why === null && act()}
    >
      {children}
    </button>
  );
}
