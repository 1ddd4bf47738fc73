import type { OneValue } from '../api';
import { measured, plainly, spoken } from '../format/number';
import { field, type Field } from '../map/field';
import type { Pin } from '../store/hash';
import type { Answered } from '../store/latest';
import { atPin, atPointer, pixelOf } from '../store/questions';
import { unitOf } from '../store/results';
import { hover, selection } from '../store/selection';

interface Texts {
  text: string;
  spoken: string;
}

const alike = (text: string): Texts => ({ text, spoken: text });

/** The value of what is shown at a pixel, with its unit, and as many digits as it has. */
function valued(shown: Field, value: number, sigma: number | null): Texts {
  const code = shown.codes?.find((one) => one.code === value);
  if (code) return alike(code.name);
  const { label, factor } = unitOf(shown.unit);
  const after = label ? ` ${label}` : '';
  if (sigma === null) return alike(`${plainly(value * factor)}${after}`);
  return {
    text: measured(value * factor, sigma * factor, label),
    spoken: spoken(value * factor, sigma * factor, label),
  };
}

/** What is known of a pixel of the map or frame that is shown; null while the answer is on its way. */
function known(shown: Field, at: Pin, { value, of, error }: Answered<string, OneValue>): Texts | null {
  if (shown.local) {
    const local = shown.local(at.x, at.y);
    return local === null ? alike('no value') : valued(shown, local, null);
  }
  if (error) return alike(error);
  if (!value || shown.asked === null || of !== pixelOf(shown.asked, at)) return null;
  if (value.value === null) return alike(value.reason ? `no value: ${value.reason}` : 'no value');
  return valued(shown, value.value, value.sigma);
}

function pinned(): Texts & { name: string } {
  const { pin: at } = selection.value;
  const shown = field.value;
  if (!at || !shown) return { text: 'Click the map to set the pin', spoken: 'no pin set', name: '' };
  const place = `(${at.x}, ${at.y})`;
  const texts = known(shown, at, atPin.state.value);
  if (!texts) return { text: `${place} \u2026`, spoken: '', name: '' };
  return { text: `${place}  ${texts.text}`, spoken: `${place} ${texts.spoken}`, name: shown.title };
}

function hovered(): string {
  const at = hover.value;
  const shown = field.value;
  if (!at || !shown) return '';
  const texts = known(shown, at, atPointer.state.value);
  return `pointer (${at.x}, ${at.y})  ${texts?.text ?? '\u2026'}`;
}

/** The value of the map or frame that is shown, at the pin and under the pointer: of that pixel alone. */
export function ValueLine() {
  const now = pinned();
  return (
    <div class="value-line">
      <span role="status" aria-label="Value at pixel" class="at-pin">
        <span aria-hidden="true">{now.text}</span>
        <span class="unseen">{now.spoken}</span>
        {now.name && <span class="at-name"> {now.name}</span>}
      </span>
      <span class="at-pointer" aria-hidden="true">
        {hovered()}
      </span>
    </div>
  );
}
