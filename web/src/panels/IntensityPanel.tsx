import { useMemo } from 'preact/hooks';
import type { PixelInfo } from '../api';
import { CurvePanel, type Curve } from '../components/CurvePanel';
import { Key } from '../components/Key';

/** Grey values along the fitted line and its two neighbours, frame by frame (figure 5a of the paper). */
export function IntensityPanel({ head }: { head: PixelInfo }) {
  const { intensity } = head;
  const x = useMemo(() => head.tau.map((_, frame) => frame), [head]);
  const curves = useMemo<Curve[]>(
    () => [
      { label: 'along the line', values: intensity?.along ?? [], tone: 'first', width: 2 },
      { label: 'left', values: intensity?.left ?? [], tone: 'second', dash: [6, 3] },
      { label: 'right', values: intensity?.right ?? [], tone: 'muted', dash: [2, 3] },
    ],
    [head],
  );
  if (!intensity) return null;
  return (
    <section>
      <h3>
        Intensity along the line<span class="muted">, {head.rows} frames</span>
      </h3>
      <Key curves={curves} />
      <CurvePanel
        name="Intensity along the fitted line, and along lines of one px less and more of disparity"
        xLabel="frame"
        yLabel="intensity (DN)"
        x={x}
        curves={curves}
        height={140}
      />
    </section>
  );
}
