import { useSignal } from '@preact/signals';
import { useEffect, useRef, useState } from 'preact/hooks';
import { api } from '../api';
import { colourTable } from '../colours/tables';
import { NumberField } from '../components/NumberField';
import { results } from '../store/results';
import { pin, selection } from '../store/selection';
import { exaggeration, palette } from '../store/settings';
import { shownRange } from '../map/field';
import { roundBelow } from '../map/scale_bar';
import type { View3d } from '../view3d';

const MOST_POINTS = 250_000;
const MOST_EXAGGERATION = 100;

/** Range and colours of the height map, so that 2-D and 3-D agree. */
function heightLook(): { low: number; high: number; table: Uint8Array } {
  const height = results.value?.maps.find(({ id }) => id === 'height');
  const shown = selection.value.map === 'height' && selection.value.frame === null;
  const range = shown ? shownRange.value : { low: height?.low ?? 0, high: height?.high ?? 1 };
  const colours = (shown && selection.value.colours) || height?.colours || 'viridis';
  return { ...range, table: colourTable(colours) };
}

/** Shows the relief a twelfth as high as the object is wide, or a little less. */
function reliefExaggeration(relief_mm: number, width_mm: number): number {
  const wanted = width_mm / 12 / relief_mm;
  return wanted > 1 && Number.isFinite(wanted) ? Math.min(roundBelow(wanted), MOST_EXAGGERATION) : 1;
}

export function View3dPanel() {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [view, setView] = useState<View3d | null>(null);
  const [problem, setProblem] = useState<string | null>(null);
  const colour = useSignal<'height' | 'photograph'>('height');

  useEffect(() => {
    let made: View3d | null = null;
    let here = true;
    const begin = async (): Promise<void> => {
      try {
        const [{ View3d: Kind }, { head, values }] = await Promise.all([
          import('../view3d'),
          api.mesh(MOST_POINTS),
        ]);
        if (!here || !canvas.current) return;
        made = new Kind(canvas.current, head, values);
        setView(made);
      } catch (error) {
        if (here) setProblem(error instanceof Error ? error.message : String(error));
      }
    };
    void begin();
    return () => {
      here = false;
      made?.end();
    };
  }, []);

  useEffect(() => {
    const box = canvas.current?.parentElement;
    if (!view || !box) return undefined;
    const observer = new ResizeObserver(() => view.resize(box.clientWidth, box.clientHeight));
    observer.observe(box);
    return () => observer.disconnect();
  }, [view]);

  const { low, high, table } = heightLook();
  const times = exaggeration.value ?? reliefExaggeration(high - low, view?.width_mm ?? NaN);
  const colours = palette.value;
  const at = pin.value;
  useEffect(() => {
    view?.show({
      exaggeration: times,
      colour: colour.value,
      table,
      low_mm: low,
      high_mm: high,
      pin: at,
      ground: colours.raised,
      ink: colours.text,
    });
  }, [view, times, colour.value, low, high, at, colours, selection.value.colours]);

  if (!results.value?.geometry)
    return <p class="hint">Heights need a calibration, so there is no 3-D view.</p>;
  const onKey = (event: KeyboardEvent): void => {
    const turns = { ArrowLeft: [-10, 1], ArrowRight: [10, 1], ArrowUp: [0, 0.9], ArrowDown: [0, 1.1] }[
      event.key
    ];
    if (!turns) return;
    event.preventDefault();
    view?.turn(turns[0]!, turns[1]!);
  };
  return (
    <div>
      <h2>3-D view</h2>
      <div class="view3d">
        <canvas
          ref={canvas}
          role="img"
          tabIndex={0}
          aria-label="Surface in 3-D; arrow keys turn and move nearer"
          onKeyDown={onKey}
        />
        {!view && <p class="hint">{problem ?? 'loading…'}</p>}
      </div>
      <div class="fields">
        <NumberField
          label="height times"
          buttons
          minimum={0.1}
          maximum={MOST_EXAGGERATION}
          step={1}
          value={times}
          onChange={(value) => (exaggeration.value = value)}
        />
        <label>
          colour{' '}
          <select
            value={colour.value}
            onChange={(event) => (colour.value = event.currentTarget.value as 'height' | 'photograph')}
          >
            <option value="height">height</option>
            <option value="photograph">photograph</option>
          </select>
        </label>
      </div>
      <p class="muted note">
        {times === 1 ? 'True proportions.' : `Heights are ${times} times too large.`} Drag turns, wheel or
        pinch zooms, right drag or two fingers move. The post stands on the pin.
      </p>
    </div>
  );
}
