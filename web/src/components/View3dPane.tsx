import { useSignal } from '@preact/signals';
import { useEffect, useRef, useState } from 'preact/hooks';
import { api } from '../api';
import { colourTable } from '../colours/tables';
import { field, shownColours, shownRange } from '../map/field';
import { pictureOf } from '../map/handle';
import { roundBelow } from '../map/scale_bar';
import { levelledBy } from '../store/levelled';
import { lengths, results } from '../store/results';
import { pin } from '../store/selection';
import { exaggeration, palette } from '../store/settings';
import type { View3d } from '../view3d';
import { NumberField } from './NumberField';
import { TakeButton } from './TakeButton';

const MOST_POINTS = 250_000;
const MOST_EXAGGERATION = 100;

/** Shows the relief a twelfth as high as the object is wide, or a little less. */
function reliefExaggeration(relief_mm: number, width_mm: number): number {
  const wanted = width_mm / 12 / relief_mm;
  return wanted > 1 && Number.isFinite(wanted) ? Math.min(roundBelow(wanted), MOST_EXAGGERATION) : 1;
}

function proportions(times: number): string {
  return times === 1 ? 'True proportions.' : `Heights are ${times} times too large.`;
}

/** The surface in place of the map: range and colours are those of the height map. */
export function View3dPane() {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [view, setView] = useState<View3d | null>(null);
  const [problem, setProblem] = useState<string | null>(null);
  const colour = useSignal<'height' | 'photograph'>('height');
  const by = levelledBy.value;
  const map = field.value?.id ?? 'height';
  const id = results.value?.id;

  useEffect(() => {
    let made: View3d | null = null;
    let here = true;
    const begin = async (): Promise<void> => {
      try {
        const [{ View3d: Kind }, { head, values }] = await Promise.all([
          import('../view3d'),
          api.mesh({ most: MOST_POINTS, map, levelled_by: by }),
        ]);
        if (!here || !canvas.current) return;
        made = new Kind(canvas.current, head, values);
        setProblem(null);
        setView(made);
      } catch (error) {
        if (here) setProblem(error instanceof Error ? error.message : String(error));
      }
    };
    void begin();
    return () => {
      here = false;
      setView(null);
      made?.end();
    };
  }, [map, by, id]);

  useEffect(() => {
    const box = canvas.current?.parentElement;
    if (!view || !box) return undefined;
    const observer = new ResizeObserver(() => view.resize(box.clientWidth, box.clientHeight));
    observer.observe(box);
    return () => observer.disconnect();
  }, [view]);

  const { low, high } = shownRange.value;
  const times = exaggeration.value ?? reliefExaggeration(high - low, view?.width_mm ?? NaN);
  const colours = palette.value;
  const at = pin.value;
  useEffect(() => {
    view?.show({
      exaggeration: times,
      colour: colour.value,
      table: colourTable(shownColours.value),
      low_mm: low,
      high_mm: high,
      unit: lengths.value,
      origin_px: results.value?.geometry?.origin_px ?? [0, 0],
      pin: at,
      ground: colours.raised,
      ink: colours.text,
    });
  }, [view, times, colour.value, low, high, at, colours, shownColours.value, lengths.value]);

  useEffect(() => {
    if (!view) return undefined;
    pictureOf.value = () => ({
      picture: view.picture(),
      devicePixels: view.devicePixels,
      words: [proportions(times)],
      coloured: colour.value === 'height',
      solid: true,
    });
    return () => {
      pictureOf.value = null;
    };
  }, [view, times, colour.value]);

  const onKey = (event: KeyboardEvent): void => {
    const turns = { ArrowLeft: [-10, 1], ArrowRight: [10, 1], ArrowUp: [0, 0.9], ArrowDown: [0, 1.1] }[
      event.key
    ];
    if (!turns) return;
    event.preventDefault();
    view?.turn(turns[0]!, turns[1]!);
  };
  return (
    <div class="view3d">
      <div class="view3d-picture">
        {/* A canvas belongs to one drawing: another surface gets another. */}
        <canvas
          key={`${id} ${map} ${by}`}
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
        <TakeButton />
        <span class="muted">
          {proportions(times)} Drag turns, wheel or pinch zooms, right drag or two fingers move. The post
          stands on the pin.
        </span>
      </div>
    </div>
  );
}
