import { useEffect, useRef, useState } from 'preact/hooks';
import { attended, watchAttention } from './attention';
import { useHold } from './useHold';

const STEP_MS = 50;

interface Props {
  /** For example "Home": it is called "Home (hold)". */
  title: string;
  /** How long it is held until it acts. */
  ms: number;
  act: () => void;
  why: string | null;
}

/** A button that acts only after it was held for a time, so that a slip does nothing. */
export function HoldButton({ title, ms, act, why }: Props) {
  const [share, setShare] = useState<number | null>(null);
  const timer = useRef<ReturnType<typeof setInterval>>(undefined);
  const end = (): void => {
    clearInterval(timer.current);
    timer.current = undefined;
    setShare(null);
  };
  const begin = (): void => {
    if (why !== null || !attended()) return;
    const began = performance.now();
    setShare(0);
    timer.current = setInterval(() => {
      const held = (performance.now() - began) / ms;
      if (held < 1) {
        setShare(held);
        return;
      }
      end();
      act();
    }, STEP_MS);
  };
  useEffect(() => watchAttention(end), []);
  useEffect(() => end, [why]);
  const hold = useHold(begin, end);
  return (
    <button
      type="button"
      class="hold-button"
      aria-label={`${title} (hold)`}
      aria-disabled={why !== null}
      title={why === null ? `Hold for ${ms / 1000} s` : `Off: ${why}`}
      {...hold}
    >
      <span class="hold-share" style={{ width: `${(share ?? 0) * 100}%` }} />
      <span class="hold-words">{share === null ? `${title} (hold)` : 'keep holding'}</span>
    </button>
  );
}
