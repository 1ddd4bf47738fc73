import { useEffect } from 'preact/hooks';
import { useSignal } from '@preact/signals';
import { NumberField } from '../components/NumberField';
import { results } from '../store/results';
import { select, selection } from '../store/selection';
import type { FrameKind } from '../api';

const FRAME_MS = 120;

/** Plays the frames in the map canvas: raw, or as they were matched. */
export function FramesPanel() {
  const frames = results.value?.frames;
  const playing = useSignal(false);
  const { frame, kind } = selection.value;
  const on = playing.value && frames !== undefined;
  useEffect(() => {
    if (!on || !frames) return undefined;
    const timer = setInterval(() => {
      select({ frame: ((selection.peek().frame ?? frames.reference) + 1) % frames.count });
    }, FRAME_MS);
    return () => clearInterval(timer);
  }, [on, frames]);
  useEffect(() => () => void (playing.value = false), []);
  if (!frames) return null;

  const show = (index: number): void => {
    const start =
      selection.peek().frame === null ? { range: { mode: 'auto' as const }, colours: null } : {};
    select({ frame: Math.round(index), ...start });
  };
  const back = (): void => {
    playing.value = false;
    select({ frame: null, range: { mode: 'auto' } });
  };
  const now = frame ?? frames.reference;
  return (
    <div>
      <h2>Frames</h2>
      <p class="muted note">
        {frames.count} frames of {frames.columns} × {frames.rows} px, {frames.bit_depth} bit. Reference:
        frame {frames.reference}; they are counted from 0. Grey goes over the full scale of the camera.
      </p>
      <div class="fields">
        <button
          type="button"
          onClick={() => show((now - 1 + frames.count) % frames.count)}
          aria-label="Frame before"
        >
          ◀ before
        </button>
        <button
          type="button"
          aria-pressed={playing.value}
          onClick={() => {
            show(now);
            playing.value = !playing.value;
          }}
        >
          {playing.value ? 'Pause' : 'Play'}
        </button>
        <button type="button" onClick={() => show((now + 1) % frames.count)} aria-label="Next frame">
          next ▶
        </button>
        <button type="button" disabled={frame === null} onClick={back}>
          Back to the map
        </button>
      </div>
      <div class="fields scrub">
        <input
          type="range"
          min="0"
          max={frames.count - 1}
          value={now}
          aria-label="Frame"
          onInput={(event) => show(Number(event.currentTarget.value))}
        />
        <NumberField label="frame" value={now} minimum={0} maximum={frames.count - 1} onChange={show} />
        {frames.kinds.length > 1 && (
          <select
            aria-label="Kind of frame"
            value={kind ?? frames.matched}
            onChange={(event) => select({ kind: event.currentTarget.value as FrameKind, frame: now })}
          >
            {frames.kinds.map((name) => (
              <option key={name} value={name}>
                {name}
              </option>
            ))}
          </select>
        )}
      </div>
      {frame === null && <p class="hint">Play, step or scrub to see frames in place of the map.</p>}
    </div>
  );
}
