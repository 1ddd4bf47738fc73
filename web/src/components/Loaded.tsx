import type { ComponentChildren } from 'preact';
import { useEffect, useState } from 'preact/hooks';

interface Props<T> {
  ask: () => Promise<T>;
  children: (value: T) => ComponentChildren;
}

/** Asks once when it appears, and shows the answer, or why there is none. */
export function Loaded<T>({ ask, children }: Props<T>) {
  const [answer, setAnswer] = useState<{ value?: T; error?: string }>({});
  const [round, setRound] = useState(0);
  useEffect(() => {
    let here = true;
    ask()
      .then((value) => here && setAnswer({ value }))
      .catch(
        (fault: unknown) =>
          here && setAnswer({ error: fault instanceof Error ? fault.message : String(fault) }),
      );
    return () => {
      here = false;
    };
  }, [round]);
  if (answer.error !== undefined) {
    return (
      <p class="fault">
        {answer.error}{' '}
        <button type="button" onClick={() => setRound(round + 1)}>
          Retry
        </button>
      </p>
    );
  }
  return answer.value === undefined ? <p class="hint">loading…</p> : <>{children(answer.value)}</>;
}
