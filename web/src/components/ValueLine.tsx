import { measured, significant, spoken } from '../format/number';
import { codesOf } from '../colours/codes';
import { field } from '../map/field';
import { handleOf, tilesCome } from '../map/handle';
import { pixel } from '../store/questions';
import { unitOf } from '../store/results';
import { hover, selection } from '../store/selection';

/** The value at the pin as text, shown and spoken. */
function pinned(): { text: string; spoken: string } {
  const { pin: at, map } = selection.value;
  if (!at) return { text: 'Click the map to set the pin', spoken: 'no pin set' };
  const place = `(${at.x}, ${at.y})`;
  const { value: reply, of, error } = pixel.state.value;
  if (error) return { text: `${place}: ${error}`, spoken: `${place}: ${error}` };
  if (!reply || of?.x !== at.x || of.y !== at.y) return { text: `${place} \u2026`, spoken: '' };
  const { head } = reply;
  const shown = head.values.find(({ id }) => id === map) ?? head.values[0];
  if (!shown || shown.value === null) {
    return { text: `${place}  no value: ${head.reason}`, spoken: `${place} no value: ${head.reason}` };
  }
  const code = codesOf(shown.id)?.find((one) => one.code === shown.value);
  if (code) return { text: `${place}  ${code.words}`, spoken: `${place} ${code.words}` };
  const { label, factor } = unitOf(shown.unit);
  const sigma = shown.sigma === null ? null : shown.sigma * factor;
  return {
    text: `${place}  ${measured(shown.value * factor, sigma, label)}`,
    spoken: `${place} ${spoken(shown.value * factor, sigma, label)}`,
  };
}

/** What the tiles in the page know about the pixel under the pointer. */
function hovered(): string {
  const at = hover.value;
  const shown = field.value;
  if (!at || !shown) return '';
  // A pointer that rests gets its value when the tile has come.
  void tilesCome.value;
  const value = handleOf.value?.read(at.x, at.y);
  const place = `pointer (${at.x}, ${at.y})`;
  if (value === null || value === undefined) return place;
  if (Number.isNaN(value)) return `${place}  no data`;
  const code = shown.codes?.find((one) => one.code === Math.round(value));
  if (code) return `${place}  ${code.words}`;
  const { label, factor } = unitOf(shown.unit);
  return `${place}  ${significant(value * factor, 4)} ${label}`;
}

export function ValueLine() {
  const now = pinned();
  return (
    <div class="value-line">
      <span role="status" aria-label="Value at pixel" class="at-pin">
        <span aria-hidden="true">{now.text}</span>
        <span class="unseen">{now.spoken}</span>
      </span>
      <span class="at-pointer" aria-hidden="true">
        {hovered()}
      </span>
    </div>
  );
}
