import { CHOICES, COLOUR_NAMES } from '../colours/tables';
import type { Colours } from '../api';
import { field, inSolid, shownColours } from '../map/field';
import { comparison } from '../store/comparison';
import { isHeight } from '../store/levelled';
import { results } from '../store/results';
import { select, selection, selectMap, tool } from '../store/selection';
import { hillshade, maskHatch, photo } from '../store/settings';
import { NumberField } from './NumberField';

function MapMenu() {
  const maps = results.value?.maps ?? [];
  const held = comparison.value;
  return (
    <select
      aria-label="Map"
      value={selection.value.frame === null ? (selection.value.map ?? '') : 'frame'}
      onChange={(event) => {
        const { value } = event.currentTarget;
        if (value === 'frame')
          select({ frame: results.peek()?.frames.reference ?? 0, range: { mode: 'auto' } });
        else selectMap(value);
      }}
    >
      {maps.map((map) => (
        <option key={map.id} value={map.id}>
          {map.title}
        </option>
      ))}
      {held && <option value="difference">Difference to {held.other}</option>}
      {held && <option value="difference-sigma">Difference / sigma</option>}
      <option value="frame">Frames</option>
    </select>
  );
}

function Overlays() {
  const shown = field.value;
  const coded = !!shown?.codes;
  return (
    <>
      {!coded && (
        <select
          aria-label="Colours"
          value={shownColours.value}
          onChange={(event) => select({ colours: event.currentTarget.value as Colours })}
        >
          {CHOICES.map((name) => (
            <option key={name} value={name}>
              {COLOUR_NAMES[name]}
            </option>
          ))}
        </select>
      )}
      <label class="check">
        <input
          type="checkbox"
          checked={maskHatch.value}
          onChange={(event) => (maskHatch.value = event.currentTarget.checked)}
        />
        mask
      </label>
      <label class="check">
        <input
          type="checkbox"
          checked={hillshade.value}
          onChange={(event) => (hillshade.value = event.currentTarget.checked)}
        />
        hillshade
      </label>
      <span class="photo">
        <input
          type="range"
          min="0"
          max="100"
          aria-label="Photograph over the map"
          value={Math.round(photo.value * 100)}
          onInput={(event) => (photo.value = Number(event.currentTarget.value) / 100)}
        />
        <NumberField
          label="photo"
          unit="%"
          minimum={0}
          maximum={100}
          step={10}
          value={Math.round(photo.value * 100)}
          onChange={(value) => (photo.value = value / 100)}
        />
      </span>
    </>
  );
}

function Tools() {
  const toggle = (name: 'line' | 'region'): void => {
    tool.value = tool.peek() === name ? 'pin' : name;
  };
  return (
    <span class="tools">
      {results.value?.geometry && (
        <button type="button" aria-pressed={inSolid.value} onClick={toggleSolid}>
          3-D
        </button>
      )}
      {!inSolid.value && (
        <>
          <button type="button" aria-pressed={tool.value === 'line'} onClick={() => toggle('line')}>
            Draw line
          </button>
          <button type="button" aria-pressed={tool.value === 'region'} onClick={() => toggle('region')}>
            Draw region
          </button>
        </>
      )}
    </span>
  );
}

/** Another map than one of heights gives way to the height map. */
function toggleSolid(): void {
  const solid = !inSolid.peek();
  const { map, frame } = selection.peek();
  if (frame !== null || map === null || !isHeight(map)) selectMap('height');
  select({ solid });
}

export function ToolBar() {
  return (
    <div class="toolbar" role="toolbar" aria-label="Map tools">
      <MapMenu />
      <details class="overlays" open={innerWidth > 700}>
        <summary>more</summary>
        <div>
          <Overlays />
        </div>
      </details>
      <Tools />
    </div>
  );
}
