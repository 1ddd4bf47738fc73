import { effect } from '@preact/signals';
import { render } from 'preact';
import { App } from './App';
import { listenToKeys } from './map/keys';
import { compareWith } from './store/comparison';
import { watchContact } from './store/contact';
import { guardJog } from './rig/jogging';
import { listenForStop } from './rig/stopping';
import { askForToken, followRig } from './rig/store';
import { followLevelling } from './store/levelled';
import { followSelection } from './store/questions';
import { follow, load, results } from './store/results';
import { mode } from './store/route';
import { keepInAddress, selection } from './store/selection';
import { applyTheme } from './store/settings';
import { followTitle } from './store/title';
import { followUse } from './store/notices';
import { takeToken } from './store/token';
import './style/base.css';
import './style/components.css';
import './style/map.css';
import './style/results.css';
import './style/frame.css';
import './style/rig.css';
import './style/stage.css';

takeToken();
applyTheme();
keepInAddress(() => {
  void load();
  if (mode.peek() === 'ui') void askForToken();
});
listenToKeys();
followUse();
followLevelling();
followSelection();
followTitle();

// What is compared follows the address; the map that is compared is the height, or else the disparity.
let compared = '';
effect(() => {
  const { compare, compareSequence: sequence } = selection.value;
  const held = results.value;
  if (!held) return;
  const other = sequence !== null ? { sequence } : compare !== null ? { results: compare } : null;
  // Of other results the same one has another difference.
  const asked = other && JSON.stringify([held.id, other]);
  if ((asked ?? '') === compared) return;
  compared = asked ?? '';
  void compareWith(other, held.maps.some(({ id }) => id === 'height') ? 'height' : 'disparity');
});

// `epirig view` has no rig: nothing to follow, nothing to stop.
mode.subscribe((now) => {
  if (now !== 'ui') return;
  followRig();
  guardJog();
  listenForStop();
});

void load();
watchContact(follow);
const page = document.getElementById('page');
if (page) render(<App />, page);
