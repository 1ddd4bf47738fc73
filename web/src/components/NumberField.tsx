import { useState } from 'preact/hooks';
import { editable, readNumber } from '../format/number';
import { markUsed, refuse } from '../store/notices';

interface Props {
  label: string;
  value: number;
  onChange: (value: number) => void;
  /** What Enter does besides. */
  onEnter?: (value: number) => void;
  minimum?: number;
  maximum?: number;
  step?: number;
  unit?: string;
  /** The digits shown resolve a thousandth of it. */
  span?: number;
  /** With buttons for less and more. */
  buttons?: boolean;
  /** The label is read out but not shown. */
  quiet?: boolean;
  disabled?: boolean;
}

/** A number that is typed or stepped. What is typed counts on Enter or when the field is left. */
export function NumberField(props: Props) {
  const { label, value, onChange, minimum = -Infinity, maximum = Infinity, step = 1, unit } = props;
  const [typed, setTyped] = useState<string | null>(null);
  const set = (next: number): void => onChange(Math.min(Math.max(next, minimum), maximum));
  const take = (): number | null => {
    const next = typed === null ? null : readNumber(typed);
    setTyped(null);
    if (next !== null) set(next);
    return next;
  };
  const enter = (): void => {
    // Text that cannot be read must not stand for the number before it.
    if (typed !== null && readNumber(typed) === null) {
      refuse(`"${typed}" is not a number, such as 12.5`);
      return;
    }
    const next = take() ?? value;
    props.onEnter?.(Math.min(Math.max(next, minimum), maximum));
  };
  return (
    <label class="number">
      <span class={props.quiet ? 'unseen' : ''}>{label}</span>
      {props.buttons && (
        <button
          type="button"
          disabled={props.disabled}
          onClick={() => set(value - step)}
          aria-label={`Less: ${label}`}
        >
          {'\u2212'}
        </button>
      )}
      <input
        inputMode="decimal"
        role="spinbutton"
        aria-valuenow={value}
        aria-label={unit ? `${label} in ${unit}` : label}
        disabled={props.disabled}
        value={typed ?? editable(value, props.span)}
        onInput={(event) => setTyped(event.currentTarget.value)}
        onBlur={(event) => {
          markUsed(event.currentTarget);
          take();
        }}
        onKeyDown={(event) => {
          // A key that is held says it once.
          if (event.key === 'Enter' && !event.repeat) enter();
          if (event.key === 'ArrowUp' || event.key === 'ArrowDown') {
            event.preventDefault();
            setTyped(null);
            set(value + (event.key === 'ArrowUp' ? step : -step));
          }
        }}
      />
      {unit && <span class="unit">{unit}</span>}
      {props.buttons && (
        <button
          type="button"
          disabled={props.disabled}
          onClick={() => set(value + step)}
          aria-label={`More: ${label}`}
        >
          +
        </button>
      )}
    </label>
  );
}
