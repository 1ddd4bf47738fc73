import { useEffect } from 'preact/hooks';
import { NumberField } from '../components/NumberField';
import type { Control } from './api';
import { onGrid, sorted } from './controls';
import { controls, followControls, setControl } from './control_store';
import { OrderButton } from './OrderButton';
import { Section } from './Section';
import { rigState } from './store';
import { exposureText, titleOf } from './texts';
import { whyNoCamera } from './why';

/** Drivers count the exposure in parts of 100 us. */
function unitOf(name: string): string | undefined {
  return name === 'exposure_time_absolute' || name === 'exposure_absolute'
    ? '\u00d7 100 \u00b5s'
    : undefined;
}

/** Why this control of all cannot be set. */
function whyFixed(control: Control): string | null {
  if (control.read_only) return 'read only';
  if (control.inactive) return 'no effect now: another control sets it automatically';
  return control.kind === 'other' ? 'controls of its kind are not supported' : null;
}

function Field({ control, why }: { control: Control; why: string | null }) {
  const { name, kind, value } = control;
  const title = titleOf(name);
  const set = (next: number): void => {
    if (next !== value) void setControl(name, next);
  };
  switch (kind) {
    case 'boolean':
      return (
        <label class="check">
          <input
            type="checkbox"
            checked={value === 1}
            disabled={why !== null}
            onChange={(event) => set(event.currentTarget.checked ? 1 : 0)}
          />
          {title}
        </label>
      );
    case 'menu':
      return (
        <label class="menu">
          <span>{title}</span>
          <select
            value={value ?? ''}
            disabled={why !== null}
            onChange={(event) => set(Number(event.currentTarget.value))}
          >
            {control.items.map(([index, words]) => (
              <option key={index} value={index}>
                {words}
              </option>
            ))}
          </select>
        </label>
      );
    case 'button':
      return (
        <OrderButton act={() => void setControl(name, 1)} why={why}>
          {title}
        </OrderButton>
      );
    default:
      return (
        <NumberField
          label={title}
          unit={unitOf(name)}
          value={value ?? control.default}
          minimum={control.minimum}
          maximum={control.maximum}
          step={Math.max(control.step, 1)}
          disabled={why !== null}
          buttons
          onChange={(next) => set(onGrid(control, next))}
        />
      );
  }
}

function Fields({ list }: { list: Control[] }) {
  return (
    <div class="controls">
      {list.map((control) => {
        const own = whyFixed(control);
        const why = own ?? whyNoCamera.value;
        return (
          <div key={control.name} class="control" title={why ?? undefined}>
            <Field control={control} why={why} />
            {own !== null && <small class="muted">{own}</small>}
          </div>
        );
      })}
    </div>
  );
}

/** Exposure and gain, always in sight. */
export function ControlsPane() {
  useEffect(followControls, []);
  const camera = rigState.value?.camera;
  const { first } = sorted(controls.value ?? []);
  return (
    <section aria-label="Camera" class="camera-pane">
      <h2>
        Camera{' '}
        <span class="muted">
          {camera?.name}
          {camera?.exposure_us != null && `, exposure ${exposureText(camera.exposure_us)}`}
        </span>
      </h2>
      <Fields list={first} />
    </section>
  );
}

/** All other controls. */
export function MoreControlsPane() {
  const { more } = sorted(controls.value ?? []);
  if (more.length === 0) return null;
  return (
    <Section title={`More camera controls (${more.length})`}>
      <Fields list={more} />
    </Section>
  );
}
