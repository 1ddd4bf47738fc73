import { keySheetOpen } from '../store/actions';
import { letterKeys } from '../store/settings';
import { keysOf } from '../map/keys';
import { view } from '../store/route';
import { Dialog } from './Dialog';

const RIG_POINTER: [string, string][] = [
  ['wheel, pinch', 'zoom at the pointer'],
  ['drag', 'move the picture'],
  ['double click, double tap', 'single pixels, or all again'],
];

const POINTER: [string, string][] = [
  ['wheel, pinch', 'zoom at the pointer'],
  ['drag', 'move the map; on touch: move the pin'],
  ['click, tap', 'set the pin'],
  ['Shift + drag', 'draw a line'],
  ['Alt + drag', 'draw a region'],
];

export function KeySheet() {
  if (!keySheetOpen.value) return null;
  const shown = view.value;
  const pointer = shown === 'rig' ? RIG_POINTER : shown === 'results' ? POINTER : [];
  return (
    <Dialog title="Keys and pointer" close={() => (keySheetOpen.value = false)}>
      <dl class="keys">
        {[...keysOf(shown), ...pointer].map(([keys, words]) => (
          <div key={keys}>
            <dt>
              <kbd>{keys}</kbd>
            </dt>
            <dd>{words}</dd>
          </div>
        ))}
      </dl>
      <label class="check">
        <input
          type="checkbox"
          checked={letterKeys.value === 'on'}
          onChange={(event) => (letterKeys.value = event.currentTarget.checked ? 'on' : 'off')}
        />
        Letters act as keys
      </label>
    </Dialog>
  );
}
