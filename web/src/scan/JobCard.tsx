import { signal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { rig, type RigState, type ScanState } from '../rig/api';
import { onlyWatches, order, rigState } from '../rig/store';
import { taken, whyNot, whyNotStart } from './control';
import { MeasureTask } from './MeasureTask';
import { Progress } from './Progress';
import { diskText, holders, millimetres, plural, timeLeft } from './words';

/** The ended scan that a person has put aside to plan another one. */
export const putAside = signal<string | null>(null);

/** Makes a sequence the one of the results view, and goes there. */
export async function openResults(name: string): Promise<void> {
  if (await taken(rig.openResults(name))) location.hash = '#results/';
}

interface OrderProps {
  /** Why it does nothing at the moment. */
  reason: string | null;
  main?: boolean;
  onClick: () => void;
  children: ComponentChildren;
}

/** A button that gives an order, or tells why it may not. A page that only watches has none. */
export function Order({ reason, main, onClick, children }: OrderProps) {
  if (onlyWatches.value) return null;
  return (
    <button
      type="button"
      class={main ? 'main' : ''}
      disabled={reason !== null}
      title={reason ?? undefined}
      onClick={onClick}
    >
      {children}
    </button>
  );
}

/** Why buttons do nothing, once for all of them. */
export function Reason({ words }: { words: string | null }) {
  return words === null || onlyWatches.value ? null : <p class="hint note reason">{words}</p>;
}

/** What still keeps a paused scan from going on; null if a person may resume it. */
function stillHeld(
  { held_by, needs_bytes, free_bytes }: ScanState,
  { camera, stage }: RigState,
): string | null {
  if (held_by.includes('disk') && needs_bytes !== null && free_bytes !== null && free_bytes < needs_bytes) {
    return `The disk is too full: ${diskText(needs_bytes, free_bytes)}. Free some space.`;
  }
  if (held_by.includes('camera') && camera.state === 'lost') return 'The camera is not there yet.';
  if (held_by.includes('stage') && stage.state === 'lost') return 'The stage is not there yet.';
  return null;
}

function Paused({ scan, state }: { scan: ScanState; state: RigState }) {
  const held = stillHeld(scan, state);
  const lost = state.camera.state === 'lost' || state.stage.state === 'lost';
  return (
    <>
      <div class="scan-state paused" role="status">
        <span aria-hidden="true">❚❚</span>
        <span>
          <b>Paused by {holders(scan.held_by)}.</b> {scan.reason}
        </span>
      </div>
      <div class="scan-buttons">
        <Order main reason={whyNot.value ?? held} onClick={() => void order(rig.resumeScan(scan.name))}>
          Resume
        </Order>
        {lost && (
          <Order reason={whyNot.value} onClick={() => void order(rig.reconnect())}>
            Connect again
          </Order>
        )}
      </div>
      <Reason words={whyNot.value ?? held} />
    </>
  );
}

function NewScan({ name }: { name: string }) {
  if (onlyWatches.value) return null;
  return (
    <button type="button" onClick={() => (putAside.value = name)}>
      New scan
    </button>
  );
}

function Failed({ scan }: { scan: ScanState }) {
  return (
    <>
      <div class="scan-state failed" role="alert">
        <span aria-hidden="true">✕</span>
        <span>
          <b>
            Failed after {scan.done} of {plural(scan.planned, 'frame')}.
          </b>{' '}
          {scan.reason ?? 'The log below tells more.'} It cannot be resumed: mend the cause, then start a
          new scan.
        </span>
      </div>
      <div class="scan-buttons">
        <NewScan name={scan.name} />
      </div>
    </>
  );
}

function Done({ scan }: { scan: ScanState }) {
  const measuring = rigState.value?.task?.kind === 'measuring';
  return (
    <>
      <div class="scan-state done" role="status">
        <span aria-hidden="true">✓</span>
        <span>
          <b>Done: {plural(scan.done, 'frame')}.</b>{' '}
          {scan.measured
            ? 'The results are there.'
            : onlyWatches.value
              ? ''
              : 'Measure it to get heights and a report.'}
        </span>
      </div>
      <MeasureTask />
      <div class="scan-buttons">
        {scan.measured ? (
          <Order main reason={whyNot.value} onClick={() => void openResults(scan.name)}>
            Open results
          </Order>
        ) : (
          <Order main reason={whyNotStart.value} onClick={() => void order(rig.measure(scan.name))}>
            Measure
          </Order>
        )}
        <NewScan name={scan.name} />
      </div>
      {!measuring && <Reason words={scan.measured ? whyNot.value : whyNotStart.value} />}
    </>
  );
}

function Running({ scan }: { scan: ScanState }) {
  const pausing = scan.state === 'pausing';
  return (
    <>
      <div class="scan-buttons">
        <Order
          reason={whyNot.value ?? (pausing ? 'Pausing.' : null)}
          onClick={() => void order(rig.pauseScan())}
        >
          Pause
        </Order>
        {pausing && <span role="status">pausing after this frame…</span>}
      </div>
      <Reason words={whyNot.value} />
    </>
  );
}

/** "101 frames, one every 0.500 mm, over 50.000 mm". */
function planned({ planned: frames }: ScanState, plan_mm: [number, number] | null): string {
  if (!plan_mm || frames < 2) return plural(frames, 'frame');
  const length = Math.abs(plan_mm[1] - plan_mm[0]);
  return `${frames} frames, one every ${millimetres(length / (frames - 1))} mm, over ${millimetres(length)} mm`;
}

/** The time left; nobody knows it while the scan waits for something. */
function left({ seconds_left, held_by, state }: ScanState): string {
  if (state !== 'paused' && held_by.length > 0) return `waiting for ${holders(held_by)}`;
  return timeLeft(seconds_left);
}

/** How far the scan is, what state it is in, and what can be done about it. */
export function JobCard({ scan, state }: { scan: ScanState; state: RigState }) {
  const ended = scan.state === 'done' || scan.state === 'failed';
  const counted = `${scan.done} of ${scan.planned}`;
  return (
    <section class="scan-job" aria-label="Scan">
      <div class="scan-name">
        <h2 title={scan.folder}>{scan.name}</h2>
        <span class="muted note">{planned(scan, state.stage.plan_mm)}</span>
      </div>
      <Progress
        name="Scan"
        done={scan.done}
        of={scan.planned}
        words={ended ? counted : `${counted}, ${left(scan)}`}
      />
      {scan.state === 'paused' && <Paused scan={scan} state={state} />}
      {scan.state === 'failed' && <Failed scan={scan} />}
      {scan.state === 'done' && <Done scan={scan} />}
      {(scan.state === 'running' || scan.state === 'pausing') && <Running scan={scan} />}
    </section>
  );
}
