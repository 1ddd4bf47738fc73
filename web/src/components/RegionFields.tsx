import { NumberField } from './NumberField';
import { region, select, tool } from '../store/selection';

const NAMES = ['x from', 'y from', 'x to', 'y to'];

/** The corners of the region as numbers; without one, how to draw it. */
export function RegionFields() {
  const area = region.value;
  if (!area) {
    return (
      <p class="hint">
        Alt + drag on the map, or{' '}
        <button type="button" onClick={() => (tool.value = 'region')}>
          Draw region
        </button>{' '}
        asks for a part of it.
      </p>
    );
  }
  return (
    <div class="fields">
      {area.map((value, index) => (
        <NumberField
          key={index}
          label={NAMES[index]!}
          unit="px"
          value={value}
          minimum={0}
          onChange={(next) => {
            const changed = area.slice() as typeof area;
            changed[index] = Math.round(next);
            if (changed[0] < changed[2] && changed[1] < changed[3]) select({ region: changed });
          }}
        />
      ))}
      <button type="button" onClick={() => select({ region: null })}>
        Clear
      </button>
    </div>
  );
}
