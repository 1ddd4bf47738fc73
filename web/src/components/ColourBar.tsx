import { useRef } from 'preact/hooks';
import { cssGradient } from '../colours/tables';
import { positionOf, sharesBeyond, valueAt } from '../colours/range';
import { percent, significant } from '../format/number';
import { field, shownColours, shownRange, type Field } from '../map/field';
import { handleMoves } from '../map/handle';
import { unitOf } from '../store/results';
import { select, selection } from '../store/selection';
import { clipMarks } from '../store/settings';
import { NumberField } from './NumberField';
import { ClipSwitch } from './ClipSwitch';
import { CodeLegend } from './CodeLegend';

/** The bar spans the shown range and some more, so that handles can be pulled outwards. */
function spanOf(shown: Field, low: number, high: number): { low: number; high: number } {
  if (shown.scale === 'log') {
    return { low: Math.min(shown.minimum, low), high: Math.max(shown.maximum, high) };
  }
  const margin = (shown.high - shown.low) * 0.25;
  return {
    low: Math.min(Math.max(shown.minimum, shown.low - margin), low),
    high: Math.max(Math.min(shown.maximum, shown.high + margin), high),
  };
}

function setRange(low: number, high: number): void {
  if (low < high) select({ range: { mode: 'hand', low, high } });
}

/** The histogram as a path, longest bar at full width; roots make small counts visible. */
function histogramPath(shown: Field, span: { low: number; high: number }): string {
  const held = shown.histogram;
  if (!held) return '';
  const bars = 64;
  const sums = new Array<number>(bars).fill(0);
  const width = (held.high - held.low) / held.counts.length;
  held.counts.forEach((count, bin) => {
    // A bin may cover several bars, or a part of one: its count is spread evenly.
    const place = (value: number): number => positionOf(value, span.low, span.high, shown.scale) * bars;
    const [from, to] = [Math.max(place(held.low + bin * width), 0), place(held.low + (bin + 1) * width)];
    for (let bar = Math.floor(from); bar < Math.min(to, bars); bar += 1) {
      const share = (Math.min(to, bar + 1) - Math.max(from, bar)) / Math.max(to - from, 1e-9);
      sums[bar] = (sums[bar] ?? 0) + count * share;
    }
  });
  const most = Math.sqrt(Math.max(...sums, 1));
  return sums
    .map((sum, bar) => {
      const y = 100 - ((bar + 1) / bars) * 100;
      return `M0 ${y}h${(Math.sqrt(sum) / most) * 100}v${100 / bars}H0z`;
    })
    .join('');
}

interface HandleProps {
  end: 'low' | 'high';
  shown: Field;
  span: { low: number; high: number };
  range: { low: number; high: number };
}

function Handle({ end, shown, span, range }: HandleProps) {
  const bar = useRef<HTMLDivElement>(null);
  const { label, factor } = unitOf(shown.unit);
  const place = positionOf(range[end], span.low, span.high, shown.scale);
  const set = (position: number): void => {
    const value = valueAt(Math.min(Math.max(position, 0), 1), span.low, span.high, shown.scale);
    setRange(end === 'low' ? value : range.low, end === 'high' ? value : range.high);
  };
  const moved = (event: PointerEvent): void => {
    const box = bar.current?.parentElement?.getBoundingClientRect();
    if (box && bar.current?.hasPointerCapture(event.pointerId))
      set(1 - (event.clientY - box.top) / box.height);
  };
  return (
    <div
      ref={bar}
      class={`handle ${end}`}
      style={{ bottom: `${place * 100}%` }}
      role="slider"
      tabIndex={0}
      aria-orientation="vertical"
      aria-label={end === 'low' ? 'Lower end of the range' : 'Upper end of the range'}
      aria-valuemin={span.low * factor}
      aria-valuemax={span.high * factor}
      aria-valuenow={range[end] * factor}
      aria-valuetext={`${significant(range[end] * factor, 4)} ${label}`}
      onPointerDown={(event) => {
        bar.current?.setPointerCapture(event.pointerId);
        handleMoves.value = true;
      }}
      onPointerMove={moved}
      onLostPointerCapture={() => (handleMoves.value = false)}
      onKeyDown={(event) => {
        const by = { ArrowUp: 0.01, ArrowDown: -0.01, PageUp: 0.1, PageDown: -0.1 }[event.key];
        if (by === undefined) return;
        event.preventDefault();
        set(place + by);
      }}
    />
  );
}

function RangeMenu({ shown }: { shown: Field }) {
  const { mode } = selection.value.range;
  return (
    <select
      aria-label="Range"
      class="range-menu"
      value={mode}
      onChange={(event) => {
        const { value } = event.currentTarget;
        const { low, high } = shownRange.peek();
        select({
          range: value === 'hand' ? { mode: 'hand', low, high } : { mode: value as 'auto' | 'full' },
        });
      }}
    >
      <option value="auto">{shown.autoName}</option>
      {(shown.low !== shown.minimum || shown.high !== shown.maximum) && <option value="full">full</option>}
      <option value="hand">by hand</option>
    </select>
  );
}

export function ColourBar() {
  const shown = field.value;
  if (!shown) return null;
  if (shown.codes) return <CodeLegend codes={shown.codes} />;
  const range = shownRange.value;
  const marks = clipMarks.value === 'on';
  const span = spanOf(shown, range.low, range.high);
  const { label, factor } = unitOf(shown.unit);
  const beyond = shown.histogram && sharesBeyond(shown.histogram, range.low, range.high);
  const bottom = positionOf(range.low, span.low, span.high, shown.scale) * 100;
  const top = positionOf(range.high, span.low, span.high, shown.scale) * 100;
  const ends = (end: 'low' | 'high') => (
    <NumberField
      label={end === 'low' ? 'Lower end' : 'Upper end'}
      quiet
      value={range[end] * factor}
      step={((range.high - range.low) * factor) / 50}
      span={shown.scale === 'log' ? range[end] * factor * 10 : (range.high - range.low) * factor}
      unit={label}
      onChange={(value) =>
        setRange(end === 'low' ? value / factor : range.low, end === 'high' ? value / factor : range.high)
      }
    />
  );
  return (
    <div class="colour-bar" role="group" aria-label={`Range of ${shown.title}`}>
      {ends('high')}
      <div class="scale">
        {marks && <div class="stripes over" style={{ height: `${100 - top}%` }} />}
        <div
          class="colours"
          style={{
            bottom: `${bottom}%`,
            height: `${top - bottom}%`,
            background: cssGradient(shownColours.value, 'top'),
          }}
        />
        {marks && <div class="stripes under" style={{ height: `${bottom}%` }} />}
        <svg viewBox="0 0 100 100" preserveAspectRatio="none" aria-hidden="true">
          <path d={histogramPath(shown, span)} />
        </svg>
        <Handle end="high" shown={shown} span={span} range={range} />
        <Handle end="low" shown={shown} span={span} range={range} />
      </div>
      {ends('low')}
      <RangeMenu shown={shown} />
      {beyond && (
        <p class="beyond">
          under {percent(beyond.under)}
          <br />
          over {percent(beyond.over)}
        </p>
      )}
      <ClipSwitch />
      {shown.autoNote && selection.value.range.mode === 'auto' && <p class="beyond">{shown.autoNote}</p>}
      {shown.scale === 'log' && <p class="beyond">log scale</p>}
    </div>
  );
}
