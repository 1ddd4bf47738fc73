import { useEffect, useRef } from 'preact/hooks';
import type { LogLine } from '../rig/api';

const MARKS: Record<LogLine['kind'], string> = { note: '', warning: '! ', error: '\u2715 ' };

/** The last lines of the log. It follows the newest line unless a person has scrolled up. */
export function ScanLog({ lines }: { lines: LogLine[] }) {
  const box = useRef<HTMLDivElement>(null);
  const follows = useRef(true);
  const newest = lines[lines.length - 1]?.number;
  useEffect(() => {
    if (box.current && follows.current) box.current.scrollTop = box.current.scrollHeight;
  }, [newest]);
  return (
    <div
      ref={box}
      class="scan-log"
      role="log"
      aria-label="Log"
      tabIndex={0}
      onScroll={({ currentTarget: { scrollTop, clientHeight, scrollHeight } }) => {
        follows.current = scrollTop + clientHeight > scrollHeight - 8;
      }}
    >
      {lines.length === 0 && <p class="hint">nothing yet</p>}
      {lines.map(({ number, at, kind, words }) => (
        <p key={number} class={kind}>
          <time>{at}</time> {MARKS[kind]}
          {words}
        </p>
      ))}
    </div>
  );
}
