import type { PixelInfo, PixelValue } from '../api';
import { measured, percent, significant, spoken, withMinus } from '../format/number';
import { isHeight, levelled } from '../store/levelled';
import { pixel } from '../store/questions';
import { results, unitOf } from '../store/results';
import { CostPanel } from './CostPanel';
import { EpiPanel } from './EpiPanel';
import { IntensityPanel } from './IntensityPanel';

function Value({ of, reason }: { of: PixelValue; reason: string }) {
  const { label, factor } = unitOf(of.unit);
  if (of.value === null) return <span class="muted">no value: {reason}</span>;
  const value = of.value * factor;
  if (of.sigma === null) {
    // Only what is measured has a sigma; a confidence or a cost has none.
    const hasSigma = of.unit === 'mm' || of.unit === 'px';
    return <>{hasSigma ? measured(value, null, label) : `${significant(value, 4)} ${label}`}</>;
  }
  const sigma = of.sigma * factor;
  return (
    <>
      <span aria-hidden="true">{measured(value, sigma, label)}</span>
      <span class="unseen">{spoken(value, sigma, label)}</span>
    </>
  );
}

function Values({ head }: { head: PixelInfo }) {
  return (
    <table class="values">
      <tbody>
        {head.values.map((value) => (
          <tr key={value.id} class={value.id === 'height' ? 'key' : ''}>
            <th scope="row">
              {value.title}
              {levelled.value && isHeight(value.id) && ' (levelled)'}
            </th>
            <td>
              <Value of={value} reason={head.reason} />
            </td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function Rank({ share }: { share: number | null }) {
  if (share === null) return null;
  return <p class="rank">sigma here is better than {percent(share)} of the map</p>;
}

export function PixelPanel() {
  const { key, value, loading, error } = pixel.state.value;
  if (!results.value?.results) return <p class="hint">Without results there are no values yet.</p>;
  if (!key) return <p class="hint">Click the map, or press an arrow key on it, to set the pin.</p>;
  if (error) return <p class="fault">{error}</p>;
  if (!value) return <p class="hint">loading…</p>;
  const { head } = value;
  const digits = Math.max(0, 1 - Math.floor(Math.log10(results.value.geometry?.pixel_mm ?? 1)));
  return (
    <div class={loading ? 'loading' : ''}>
      <h2 class="at">
        At ({head.x}, {head.y}){' '}
        {head.x_mm !== null && head.y_mm !== null && (
          <span class="muted">
            = {withMinus(head.x_mm.toFixed(digits))}, {withMinus(head.y_mm.toFixed(digits))} mm
          </span>
        )}
      </h2>
      <Values head={head} />
      <p class="muted note">sigma is the standard uncertainty (k = 1). That of the scale is not in it.</p>
      <EpiPanel head={head} values={value.values} />
      <IntensityPanel head={head} />
      <CostPanel head={head} />
      <Rank share={head.better_than} />
    </div>
  );
}
