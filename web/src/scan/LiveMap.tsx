import { useEffect, useRef, useState } from 'preact/hooks';
import { ClipSwitch } from '../components/ClipSwitch';
import { ZoomButtons } from '../components/ZoomButtons';
import { positionOf, valueAt } from '../colours/range';
import { cssGradient } from '../colours/tables';
import { percent, significant } from '../format/number';
import { tickText } from '../map/scale_bar';
import type { ScanState } from '../rig/api';
import { clipMarks } from '../store/settings';
import '../style/live_map.css';
import { clipped } from './held_range';
import { LiveCanvas } from './live_canvas';
import {
  cellText,
  followLiveMap,
  liveFault,
  liveHover,
  liveKind,
  liveMap,
  livePair,
  livePin,
  liveRange,
  rangeAnew,
  type LiveKind,
} from './live_map';
import { sigmaPair } from './words';

const TITLES: Record<LiveKind, string> = { disparity: 'Disparity map', sigma: 'Sigma map' };

/** What the map was made of, and how far its sigma has fallen. */
function Caption({ scan }: { scan: ScanState }) {
  const { map, course, planned } = scan;
  if (!map) return null;
  const first = course[0];
  const older = first && first[0] < map.frames ? first : null;
  const [now, before] = sigmaPair(map.sigma_px, older?.[1] ?? map.sigma_px);
  return (
    <p class="scan-caption">
      stops 1{'\u2013'}
      {map.frames} of {planned}, sigma median {now} px
      {map.sigma_mm !== null && ` = ${significant(map.sigma_mm, 2)} mm`}
      {older && (
        <span class="muted">
          {' '}
          (was {before} at stop {older[0]})
        </span>
      )}
    </p>
  );
}

function Tools() {
  const range = liveRange.value;
  return (
    <div class="scan-map-tools" role="toolbar" aria-label="Map tools">
      <select
        aria-label="Map"
        value={liveKind.value}
        onChange={(event) => (liveKind.value = event.currentTarget.value as LiveKind)}
      >
        <option value="disparity">Disparity (px)</option>
        <option value="sigma">Sigma (px)</option>
      </select>
      <ClipSwitch />
      {range && (
        <span class="scan-held">
          <span class="muted">range held at stop {range.frames}</span>
          <button type="button" onClick={rangeAnew} title="Take the range of the map that is shown">
            auto
          </button>
        </span>
      )}
    </div>
  );
}

const TICKS = 5;

/** Colours with their numbers, and the stripes of values beyond. */
function Bar() {
  const map = liveMap.value;
  const range = liveRange.value;
  if (!map || !range) return null;
  const { low, high } = range;
  const scale = liveKind.value === 'sigma' ? 'log' : 'linear';
  const { under, over } = clipped(map.values, low, high);
  const marks = clipMarks.value === 'on';
  const step = 10 ** Math.floor(Math.log10((high - low) / 50));
  const text = (value: number): string =>
    scale === 'log' ? significant(value, 2) : tickText(value, Math.min(step, 1));
  const ticks = Array.from({ length: TICKS }, (_, tick) => valueAt(tick / (TICKS - 1), low, high, scale));
  return (
    <div
      class="live-bar"
      role="group"
      aria-label={`Colours of the ${TITLES[liveKind.value].toLowerCase()}`}
    >
      <span class="unit">
        {map.head.unit}
        {scale === 'log' && ', log'}
      </span>
      <div class="live-scale">
        {marks && over > 0 && <div class="stripes over" />}
        <div class="live-ticks">
          <div
            class="live-colours"
            style={{ background: cssGradient(scale === 'log' ? 'magma' : 'viridis', 'top') }}
          />
          <ol>
            {ticks.map((value) => (
              <li key={value} style={{ bottom: `${positionOf(value, low, high, scale) * 100}%` }}>
                {text(value)}
              </li>
            ))}
          </ol>
        </div>
        {marks && under > 0 && <div class="stripes under" />}
      </div>
      <span class="beyond">
        over {percent(over)}
        <br />
        under {percent(under)}
      </span>
    </div>
  );
}

/** The value at the pin, shown and spoken, and that under the pointer. */
function Values() {
  const pair = livePair.value;
  const [pin, hover] = [livePin.value, liveHover.value];
  const pinned = pair && pin ? cellText(pair, pin) : null;
  return (
    <div class="value-line">
      <span role="status" aria-label="Value at pixel" class="at-pin">
        {pinned ? (
          <>
            <span aria-hidden="true">{pinned.text}</span>
            <span class="unseen">{pinned.spoken}</span>
          </>
        ) : (
          <span class="muted">{pair ? 'Click the map to set the pin' : ''}</span>
        )}
      </span>
      <span class="at-pointer" aria-hidden="true">
        {pair && hover && `pointer ${cellText(pair, hover).text}`}
      </span>
    </div>
  );
}

function Canvas() {
  const gl = useRef<HTMLCanvasElement>(null);
  const marks = useRef<HTMLCanvasElement>(null);
  const [problem, setProblem] = useState<string | null>(null);
  useEffect(() => {
    if (!gl.current || !marks.current) return undefined;
    const canvas = new LiveCanvas(gl.current, marks.current, setProblem);
    return () => canvas.end();
  }, []);
  return (
    <div class="map live-map">
      <canvas ref={gl} class="map-values" />
      <canvas
        ref={marks}
        class="map-marks"
        role="img"
        tabIndex={0}
        aria-label={TITLES[liveKind.value]}
        aria-describedby="live-map-help"
      />
      <span id="live-map-help" class="unseen">
        Arrow keys move the pin, plus and minus zoom, 0 shows all. The value at the pin is read out below.
      </span>
      <ZoomButtons />
      {problem && (
        <p class="map-problem" role="alert">
          {problem}
        </p>
      )}
    </div>
  );
}

/** The map that grows sharper with every stop. */
export function LiveMap({ scan }: { scan: ScanState }) {
  useEffect(followLiveMap, []);
  const here = livePair.value?.scan === scan.name;
  return (
    <section class="scan-map" aria-label="Live map">
      <div class="scan-map-head">
        <h2>Live map</h2>
        <Caption scan={scan} />
        <Tools />
      </div>
      {here ? (
        <div class="map-row">
          <Canvas />
          <Bar />
        </div>
      ) : (
        <p class="scan-no-map hint">
          {liveFault.value ?? 'The first map comes when there are enough frames for it.'}
        </p>
      )}
      <Values />
    </section>
  );
}
