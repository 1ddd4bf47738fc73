import { useEffect } from 'preact/hooks';
import { NumberField } from '../components/NumberField';
import { refuse } from '../store/notices';
import type { Control } from './api';
import { onGrid, sorted } from './controls';
import { controls, followControls, setControl } from './control_store';
import { OrderButton } from './OrderButton';
import { Section } from './Section';
import { onlyWatches, rigState } from './store';
import { exposureText, titleOf, unitOf, valueText } from './texts';
import { whyNoCamera } from './why';

/** Why this control of all cannot be set. */
function whyFixed(control: Control): string | null {
  if (control.read_only) return 'read only';
  if (control.inactive) return 'no effect now: another control sets it automatically';
  return control.kind === 'other' ? 'controls of its kind are not supported' : null;
}

/** The value of a control in words, where nobody can set it. */
function words({ name, kind, value, items }: Control): string {
  if (value === null) return 'not known';
  if (kind === 'boolean') return value === 1 ? 'on' : 'off';
  return items.find(([index]) => kind === 'menu' && index === value)?.[1] ?? valueText(name, value);
}

function Field({ control, why }: { control: Control; why: string | null }) {
  const { name, kind, value } = control;
  const title = titleOf(name);
  if (onlyWatches.value) return kind === 'button' ? null : <span>{`${title}: ${words(control)}`}</span>;
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
    default: {
      const { unit, counts } = unitOf(name);
      return (
        <NumberField
          label={title}
          unit={unit}
          value={(value ?? control.default) / counts}
          step={Math.max(control.step, 1) / counts}
          disabled={why !== null}
          buttons
          onChange={(next) => {
            const near = onGrid(control, next * counts);
            const range = [control.minimum, control.maximum]
              .map((one) => valueText(name, one))
              .join(' to ');
            // What lies between two values of the control is rounded; what lies beyond its range is told.
            if (Math.abs(near - next * counts) > Math.max(control.step, 1))
              refuse(`${title} goes from ${range}`);
            set(near);
          }}
        />
      );
    }
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
