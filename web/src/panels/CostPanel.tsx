import { useMemo } from 'preact/hooks';
import type { PixelInfo } from '../api';
import { CurvePanel, type Curve } from '../components/CurvePanel';
import { significant } from '../format/number';

/** The cost against disparity: a narrow, single minimum is a good answer. */
export function CostPanel({ head }: { head: PixelInfo }) {
  const { cost, line } = head;
  const curves = useMemo<Curve[]>(
    () => [{ label: 'cost', values: cost?.cost ?? [], tone: 'first', width: 1.5 }],
    [head],
  );
  if (!cost) return null;
  const chosen = cost.chosen_px;
  const mark = chosen === null ? null : { at: chosen, half: line?.sigma_px ?? 0 };
  return (
    <section>
      <h3>
        Cost against disparity
        <span class="muted">
          {chosen === null
            ? ', nothing chosen'
            : `, dashed: chosen, ${significant(chosen, 4)} px; band ± sigma`}
        </span>
      </h3>
      <CurvePanel
        name="Cost against disparity"
        xLabel="disparity (px)"
        yLabel={`cost (${cost.scale})`}
        x={cost.disparity_px}
        curves={curves}
        mark={mark}
        height={140}
      />
    </section>
  );
}
