import { useRef } from 'preact/hooks';
import type { Budget, Roughness, SurfaceSummary } from '../api';
import { RegionFields } from '../components/RegionFields';
import { count, interval, percent } from '../format/number';
import { chooseMask, mask, maskFault } from '../store/mask';
import { surface, trend } from '../store/questions';
import { lengths, results, trends } from '../store/results';
import { region, select } from '../store/selection';

function coverage({ combined }: Budget): string {
  if (combined === null) return 'interval unknown: too few independent parts';
  return `± holds 95 % coverage (k = ${combined.coverage_factor.toFixed(2)})`;
}

function BudgetTable({ contributions }: Budget) {
  const { label, factor } = lengths.value;
  return (
    <table class="list budget">
      <caption>Uncertainty budget of the depth: standard uncertainties u (k = 1)</caption>
      <thead>
        <tr>
          <th scope="col">contribution</th>
          <th scope="col">type</th>
          <th scope="col">u ({label})</th>
          <th scope="col">share</th>
        </tr>
      </thead>
      <tbody>
        {contributions.map(({ name, evaluation, sigma_mm, share }) => (
          <tr key={name}>
            <th scope="row">{name}</th>
            <td>{evaluation}</td>
            <td>{sigma_mm === null ? 'not known' : (sigma_mm * factor).toPrecision(2)}</td>
            <td>{share === null ? '' : `${Math.round(100 * share)} %`}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

/** The verdict about the limits, if there are any. */
function VerdictLine({ of }: { of: SurfaceSummary }) {
  const { verdict, verdict_sentence } = of.conclusion;
  if (!verdict_sentence) return null;
  return (
    <p class={verdict === 'pass' ? 'verdict' : 'verdict fault'}>{verdict_sentence.replaceAll('+-', '±')}</p>
  );
}

function StepHeight({ of }: { of: SurfaceSummary }) {
  const { label, factor } = lengths.value;
  if (!of.levels)
    return (
      <>
        <p>No step height: {of.no_levels ?? 'the reason is not recorded'}</p>
        <VerdictLine of={of} />
      </>
    );
  const { depth, budget, raised, margin_px, parts } = of.levels;
  const half = budget.combined === null ? null : budget.combined.half_width_95_mm * factor;
  return (
    <>
      <p class="key-number">{interval(depth.depth_mm * factor, half, label)}</p>
      <p>{coverage(budget)}</p>
      <p>{of.conclusion.sentence.replace('+-', '±')}</p>
      <VerdictLine of={of} />
      <p class="muted">
        Step height between the two levels; parts are {raised ? 'raised' : 'hollows'}; {margin_px} px beside
        the walls are left out.
      </p>
      <div class="wide" tabIndex={0} role="region" aria-label="Uncertainty budget">
        <BudgetTable {...budget} />
      </div>
      {parts.length > 1 && <Parts of={of} />}
    </>
  );
}

function Parts({ of }: { of: SurfaceSummary }) {
  const { label, factor } = lengths.value;
  return (
    <div class="wide" tabIndex={0} role="region" aria-label="List of parts">
      <table class="list">
        <caption>Parts, depth in {label}: ± holds 95 % coverage by the scatter in the part alone</caption>
        <thead>
          <tr>
            <th scope="col">centre (px)</th>
            <th scope="col">area (mm²)</th>
            <th scope="col">depth ({label})</th>
          </tr>
        </thead>
        <tbody>
          {of.levels?.parts.map((part) => {
            const half = part.depth.half_width_95_mm === null ? null : part.depth.half_width_95_mm * factor;
            const [x, y] = [Math.round(part.centre_x_px), Math.round(part.centre_y_px)];
            return (
              <tr key={`${x},${y}`}>
                <td>
                  <button type="button" class="plain" onClick={() => select({ pin: { x, y } })}>
                    {x}, {y}
                  </button>
                </td>
                <td>{part.area_mm2.toFixed(2)}</td>
                <td>{interval(part.depth.depth_mm * factor, half, '')}</td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}

function RoughnessTable({ of }: { of: Roughness }) {
  const { label, factor } = lengths.value;
  const digits = label === 'mm' ? 4 : 1;
  const rows: [name: string, words: string, value_mm: number | null][] = [
    ['Sa', 'mean distance from the mean height', of.sa_mm],
    ['Sq', 'root mean square', of.sq_mm],
    ['Sz', 'lowest to highest pixel, outliers left out', of.sz_mm],
    ['Sq noise', 'what the sigmas of the pixels predict for a flat surface', of.sq_noise_mm],
    ['Sq without noise', 'root of the difference of squares', of.sq_without_noise_mm],
  ];
  return (
    <table class="list">
      <caption>
        Roughness after removal of the form (ISO 25178-2), {count(of.pixels)} pixels, in {label}
      </caption>
      <tbody>
        {rows.map(([name, words, value]) => (
          <tr key={name}>
            <th scope="row" title={words}>
              {name}
            </th>
            <td>{value === null ? 'not known' : (value * factor).toFixed(digits)}</td>
            <td class="muted">{words}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

/** A mask as a picture file, as `surface --mask` takes it. */
function MaskField({ of }: { of: SurfaceSummary | null }) {
  const input = useRef<HTMLInputElement>(null);
  const used = of?.field?.mask;
  const size = results.value?.frames;
  return (
    <div class="fields">
      <label>
        mask picture{' '}
        <input
          ref={input}
          type="file"
          accept="image/*,.pgm,.ppm,.tif,.tiff"
          aria-describedby="mask-words"
          onChange={(event) => void chooseMask(event.currentTarget.files?.[0] ?? null)}
        />
      </label>
      {mask.value && (
        <button
          type="button"
          onClick={() => {
            void chooseMask(null);
            // The button goes; who uses the keyboard goes on from the field.
            if (input.current) {
              input.current.value = '';
              input.current.focus();
            }
          }}
        >
          Clear mask
        </button>
      )}
      <p id="mask-words" class="muted">
        {mask.value && used && size
          ? `${percent(used.inside_px / (size.rows * size.columns))} of the picture are inside the mask ${used.file}.`
          : 'A picture as large as the frames; what is white is used.'}
      </p>
      {maskFault.value && (
        <p class="fault" role="alert">
          {maskFault.value}
        </p>
      )}
    </div>
  );
}

/** Step height and roughness of a region, or of the whole map as `surface` found them. */
export function StepsPanel() {
  const { value, error, loading } = surface.state.value;
  const held = results.value;
  if (!held?.geometry) return <p class="hint">Heights need a calibration, so there are no steps in mm.</p>;
  const asked = region.value !== null || mask.value !== null;
  // An answer from before a refusal is none to what was refused.
  const answered = error ? null : value;
  const shown = asked ? answered : held.surface;
  const part = region.value ? (mask.value ? 'region and mask' : 'region') : mask.value ? 'mask' : 'map';
  return (
    <div class={loading ? 'loading' : ''}>
      <h2>Steps and roughness of the {part}</h2>
      <RegionFields />
      <MaskField of={asked ? answered : null} />
      {asked && (
        <label>
          form{' '}
          <select value={trend.value} onChange={(event) => (trend.value = event.currentTarget.value)}>
            {trends.value.map(({ name, title }) => (
              <option key={name} value={name}>
                {title}
              </option>
            ))}
          </select>
        </label>
      )}
      {error && (
        <p class="fault" role="alert">
          {error}
        </p>
      )}
      {loading && !shown && <p class="hint">computing…</p>}
      {!asked && !shown && <p>epirig surface was not run on these results.</p>}
      {shown && (
        <>
          <StepHeight of={shown} />
          <RoughnessTable of={shown.roughness} />
        </>
      )}
    </div>
  );
}
