import type { LinePoint } from '../api';
import { NumberField } from '../components/NumberField';
import { interval, measured, significant } from '../format/number';
import { lengths } from '../store/results';
import { between, pointAt, type Cursors } from './between';

interface Props {
  points: LinePoint[];
  cursors: Cursors | null;
  onChange: (cursors: Cursors | null) => void;
}

function Difference({ points, cursors }: { points: LinePoint[]; cursors: Cursors }) {
  const { label, factor } = lengths.value;
  const [one, other] = cursors.map((at) => points[pointAt(points, at)]!) as [LinePoint, LinePoint];
  const found = between(one, other);
  if (!found) return <p>A cursor stands where there is no height.</p>;
  const { dx_mm, dz_mm, sigma_mm, slope_deg } = found;
  const step = measured(dz_mm * factor, sigma_mm === null ? null : sigma_mm * factor, label);
  const slope = slope_deg === null ? 'none' : `${significant(slope_deg, 3)}°`;
  return (
    <p title="sigma holds if the errors of both heights are independent, as those of pixels that are far apart">
      dx {interval(dx_mm, null, 'mm')}; dz {step}; slope {slope}
    </p>
  );
}

/** Two cursors on a profile, and what lies between them: distance, step with its sigma, slope. */
export function ProfileCursors({ points, cursors, onChange }: Props) {
  const length_mm = points.at(-1)?.distance_mm ?? 0;
  if (!cursors)
    return (
      <div class="fields">
        <button type="button" onClick={() => onChange([0.25 * length_mm, 0.75 * length_mm])}>
          Cursors
        </button>
      </div>
    );
  const set = (which: 0 | 1, at: number): void =>
    onChange(which === 0 ? [at, cursors[1]] : [cursors[0], at]);
  return (
    <div class="fields" role="group" aria-label="Cursors">
      {([0, 1] as const).map((which) => (
        <NumberField
          key={which}
          label={`cursor ${which + 1}`}
          unit="mm"
          minimum={0}
          maximum={length_mm}
          span={length_mm}
          step={length_mm / 100}
          value={cursors[which]}
          onChange={(at) => set(which, at)}
        />
      ))}
      <button type="button" onClick={() => onChange(null)}>
        Clear cursors
      </button>
      <Difference points={points} cursors={cursors} />
    </div>
  );
}
