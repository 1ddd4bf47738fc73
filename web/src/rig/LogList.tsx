import { useEffect, useRef } from 'preact/hooks';
import { rigState } from './store';

const ICONS = { note: '', warning: '! ', error: '✕ ' } as const;

/** What happened, the newest last and in sight. */
export function LogList() {
  const lines = rigState.value?.log ?? [];
  const list = useRef<HTMLUListElement>(null);
  const last = lines[lines.length - 1]?.number;
  useEffect(() => {
    list.current?.scrollTo({ top: list.current.scrollHeight });
  }, [last]);
  return (
    <section class="rig-log" aria-label="Log">
      <h2 class="unseen">Log</h2>
      {lines.length === 0 ? (
        <p class="hint">nothing has happened yet</p>
      ) : (
        <ul ref={list} class="log" tabIndex={0} aria-label="Log lines">
          {lines.map(({ number, at, kind, words }) => (
            <li key={number} class={kind}>
              <time>{at}</time> {ICONS[kind]}
              {words}
            </li>
          ))}
        </ul>
      )}
    </section>
  );
}
