import { keySheetOpen } from '../store/actions';
import { letterKeys } from '../store/settings';
import { KEYS } from '../map/keys';
import { Dialog } from './Dialog';

const POINTER: [string, string][] = [
  ['wheel, pinch', 'zoom at the pointer'],
  ['drag', 'move the map; on touch: move the pin'],
  ['click, tap', 'set the pin'],
  ['Shift + drag', 'draw a line'],
  ['Alt + drag', 'draw a region'],
];

export function KeySheet() {
  if (!keySheetOpen.value) return null;
  return (
    <Dialog title="Keys and pointer" close={() => (keySheetOpen.value = false)}>
      <dl class="keys">
        {[...KEYS, ...POINTER].map(([keys, words]) => (
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
