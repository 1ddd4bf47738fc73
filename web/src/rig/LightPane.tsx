import { useSignal } from '@preact/signals';
import { significant } from '../format/number';
import { rig, type LightState } from './api';
import { histogramPath } from './histogram';
import { cornersText } from './LivePicture';
import { OrderButton } from './OrderButton';
import { stale } from './picture_store';
import { Section } from './Section';
import { order, rigState } from './store';
import { shareText } from './texts';
import { whyNoCamera } from './why';

/** Mean light below this share of full scale tells nothing of sharpness. */
const DARK = 0.02;

/** How sharp the picture is, against the sharpest so far. */
export function FocusPane() {
  const light = rigState.value?.light ?? null;
  // In the dark the sharpness is that of noise.
  const dark = light !== null && light.mean_dn < DARK * light.full_scale_dn;
  const share = light && !dark && light.focus_peak > 0 ? Math.min(light.focus / light.focus_peak, 1) : 0;
  return (
    <section class={`focus ${stale.value ? 'dimmed' : ''}`} aria-label="Focus">
      <h2>Focus</h2>
      <strong class="key-number">{light && !dark ? significant(light.focus, 3) : '\u2013'}</strong>
      <span
        class="meter"
        role="meter"
        aria-label="Focus against its peak"
        aria-valuemin={0}
        aria-valuemax={100}
        aria-valuenow={Math.round(share * 100)}
        aria-valuetext={`${Math.round(share * 100)} % of peak`}
      >
        <span style={{ width: `${share * 100}%` }} />
      </span>
      <span>
        {dark
          ? '! too dark to judge'
          : `${Math.round(share * 100)} % of peak ${light ? significant(light.focus_peak, 3) : '\u2013'}`}
      </span>
      <OrderButton act={() => void order(rig.resetPeak())} why={whyNoCamera.value} name="reset peak">
        reset
      </OrderButton>
    </section>
  );
}

const WIDTH = 256;
const HEIGHT = 48;

function Bars({ light, logarithmic }: { light: LightState; logarithmic: boolean }) {
  const most = Math.ceil((light.full_scale_dn + 1) / light.bin_width_dn);
  return (
    <svg
      class="histogram"
      viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
      preserveAspectRatio="none"
      role="img"
      aria-label={`Histogram from ${light.minimum_dn} to ${light.maximum_dn} DN, mean ${significant(light.mean_dn, 4)} DN`}
    >
      <path d={histogramPath(light.histogram, most, WIDTH, HEIGHT, logarithmic)} />
    </svg>
  );
}

/** How bright the pixels are: all raw samples, so that nothing saturated is missed. */
export function HistogramPane() {
  const logarithmic = useSignal(true);
  const state = rigState.value;
  const light = state?.light ?? null;
  return (
    <Section title="Histogram">
      {light ? (
        <div class={stale.value ? 'dimmed' : ''}>
          <Bars light={light} logarithmic={logarithmic.value} />
          <p class="axis">
            <span>0</span>
            <span>
              mean {significant(light.mean_dn, 4)}, raw, {state?.camera.bit_depth} bit
            </span>
            <label class="check">
              <input
                type="checkbox"
                checked={logarithmic.value}
                onChange={(event) => (logarithmic.value = event.currentTarget.checked)}
              />
              log counts
            </label>
            <span>{light.full_scale_dn} DN</span>
          </p>
          <p class="shares">
            <span class={light.saturated > 0 ? 'amber' : ''}>
              {light.saturated > 0 && '! '}saturated {shareText(light.saturated, light.pixels)}
            </span>
            <span>dark {shareText(light.black, light.pixels)}</span>
            <span>corners {cornersText(light.corners)}</span>
          </p>
        </div>
      ) : (
        <p class="hint">no picture yet</p>
      )}
    </Section>
  );
}
