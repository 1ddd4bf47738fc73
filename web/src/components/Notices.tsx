import { useLayoutEffect, useRef, useState } from 'preact/hooks';
import { notice, type Notice } from '../store/notices';
import { placeBeside } from './beside';

/** What was refused, beside the field or button: over the page, so that nothing moves away from a finger. */
function Refused({ told, at }: { told: Notice; at: Element }) {
  const words = useRef<HTMLParagraphElement>(null);
  const [place, setPlace] = useState<{ left: number; top: number } | null>(null);
  useLayoutEffect(() => {
    const put = (): void => {
      if (!words.current) return;
      const bars = [...document.querySelectorAll('.bar, .stop-bar, button.stop')];
      const kept = bars.map((bar) => bar.getBoundingClientRect());
      const size = words.current.getBoundingClientRect();
      const screen = { width: innerWidth, height: innerHeight };
      setPlace(at.isConnected ? placeBeside(at.getBoundingClientRect(), size, screen, kept) : null);
    };
    put();
    addEventListener('scroll', put, { capture: true, passive: true });
    addEventListener('resize', put);
    return () => {
      removeEventListener('scroll', put, { capture: true });
      removeEventListener('resize', put);
    };
  }, [told]);
  return (
    <p
      ref={words}
      class={`notice refused ${place ? 'beside' : 'below'}`}
      role="alert"
      style={place ? { left: `${place.left}px`, top: `${place.top}px` } : undefined}
    >
      <span aria-hidden="true">✕ </span>
      {told.words}
    </p>
  );
}

/** Words to the person. They lie over the page under the bar, or beside what they are about, and take no press. */
export function Notices() {
  const told = notice.value;
  const done = told?.kind === 'done' ? told.words : '';
  return (
    <div class="notices">
      <p class={`notice done below ${done ? '' : 'none'}`} role="status" aria-label="Notice">
        {done}
      </p>
      {told?.kind === 'refused' &&
        (told.at ? (
          <Refused key={told.words} told={told} at={told.at} />
        ) : (
          <p class="notice refused below" role="alert">
            <span aria-hidden="true">✕ </span>
            {told.words}
          </p>
        ))}
    </div>
  );
}
