import { copyLink, keySheetOpen, notice } from '../store/actions';
import { about, results } from '../store/results';
import { select } from '../store/selection';
import { themeChoice } from '../store/settings';

const NEXT = { system: 'dark', dark: 'light', light: 'system' } as const;

export function AppBar() {
  const held = results.value;
  return (
    <header class="bar">
      <strong class="brand">epirig</strong>
      <nav aria-label="Views">
        {/* Without a rig there is only one view. */}
        {about.value?.mode === 'ui' && <span class="tab-off">Rig</span>}
        {about.value?.mode === 'ui' && <span class="tab-off">Scan</span>}
        <a class="tab-on" href="#map" aria-current="page" onClick={(event) => event.preventDefault()}>
          Results
        </a>
      </nav>
      <span class="sequence" title={held?.sequence.name}>
        {held?.sequence.name ?? ''}
      </span>
      <span class="notice" role="status" aria-label="Notice">
        {notice.value}
      </span>
      <span class="bar-buttons">
        <button type="button" onClick={() => void copyLink()}>
          Copy link
        </button>
        <button type="button" onClick={() => select({ panel: 'downloads' })}>
          Download
        </button>
        <button type="button" onClick={() => (themeChoice.value = NEXT[themeChoice.value])}>
          Theme: {themeChoice.value}
        </button>
        <button type="button" onClick={() => (keySheetOpen.value = true)} aria-label="Keys">
          ?
        </button>
      </span>
    </header>
  );
}
