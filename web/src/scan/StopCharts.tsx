import { useMemo } from 'preact/hooks';
import { CurvePanel, type Curve } from '../components/CurvePanel';
import type { ScanState, Stop } from '../rig/api';

/** The same object as long as its content is the same: each state of the rig is a new one. */
function useSame<T>(value: T): T {
  return useMemo(() => value, [JSON.stringify(value)]);
}

/** Position error and mean light of every stop. */
export function StopCharts({ stops }: { stops: Stop[] }) {
  const held = useSame(stops);
  const x = useMemo(() => held.map(({ index }) => index), [held]);
  const error = useMemo<Curve[]>(
    () => [
      {
        label: 'reported minus planned',
        values: held.map(({ reported_mm, planned_mm }) => (reported_mm - planned_mm) * 1000),
        tone: 'first',
        points: true,
      },
    ],
    [held],
  );
  const light = useMemo<Curve[]>(
    () => [
      { label: 'mean light', values: held.map(({ mean_dn }) => mean_dn), tone: 'second', points: true },
    ],
    [held],
  );
  if (held.length === 0) return <p class="hint">no stop yet</p>;
  return (
    <>
      <CurvePanel
        name="Reported minus planned position at every stop, in micrometres"
        xLabel="frame"
        yLabel="error (µm)"
        x={x}
        curves={error}
        height={130}
      />
      <CurvePanel
        name="Mean light of the frame of every stop, in counts"
        xLabel="frame"
        yLabel="mean (DN)"
        x={x}
        curves={light}
        height={130}
      />
    </>
  );
}

/** How the median sigma has fallen, one dot per map. */
export function SigmaCourse({ course }: { course: ScanState['course'] }) {
  const held = useSame(course);
  const x = useMemo(() => held.map(([frames]) => frames), [held]);
  const curves = useMemo<Curve[]>(
    () => [{ label: 'sigma median', values: held.map(([, sigma]) => sigma), tone: 'first', points: true }],
    [held],
  );
  if (held.length === 0) return null;
  return (
    <CurvePanel
      name="Median sigma of the live map against the frames that it was made of"
      xLabel="frames"
      yLabel="sigma (px)"
      log
      x={x}
      curves={curves}
      height={120}
    />
  );
}
