import { BarStatus } from '../rig/BarStatus';
import { SequenceMenu } from '../rig/SequenceMenu';
import { StageWords } from '../rig/StageWords';
import { StopButton } from '../rig/StopButton';
import { copyLink, keySheetOpen, openReport } from '../store/actions';
import { results } from '../store/results';
import { mode, view, type ViewName } from '../store/route';
import { hashOf, select, showView } from '../store/selection';
import { themeChoice } from '../store/settings';

const NEXT = { system: 'dark', dark: 'light', light: 'system' } as const;

const TABS: [name: ViewName, words: string][] = [
  ['rig', 'Rig'],
  ['scan', 'Scan'],
  ['results', 'Results'],
  ['sequences', 'Sequences'],
];

function Tabs() {
  // Without a rig there is only one view.
  const tabs = TABS.filter(([name]) => mode.value === 'ui' || name === 'results');
  return (
    <nav aria-label="Views">
      {tabs.map(([name, words]) => {
        const shown = name === (view.value ?? 'results');
        return (
          <a
            key={name}
            class={shown ? 'tab-on' : 'tab-off'}
            href={hashOf(name)}
            aria-current={shown ? 'page' : undefined}
            onClick={(event) => {
              event.preventDefault();
              showView(name);
            }}
          >
            {words}
          </a>
        );
      })}
    </nav>
  );
}

function ResultButtons() {
  const shown = mode.value === 'ui' ? view.value === 'results' && results.value : true;
  if (!shown) return null;
  return (
    <span class="result-buttons">
      <button type="button" onClick={() => void copyLink()}>
        Copy link
      </button>
      {results.value?.surface && (
        <button type="button" class="bar-report" onClick={() => void openReport()}>
          Report
        </button>
      )}
      <button type="button" class="bar-download" onClick={() => select({ panel: 'downloads' })}>
        Download
      </button>
    </span>
  );
}

function Sequence() {
  const held = results.value;
  if (mode.value === 'ui') return view.value === 'results' ? <SequenceMenu /> : null;
  return (
    <span class="sequence" title={held?.sequence.name}>
      {held?.sequence.name ?? ''}
    </span>
  );
}

export function AppBar() {
  const ui = mode.value === 'ui';
  return (
    <header class={`bar ${ui ? 'with-rig' : ''}`} data-view={view.value}>
      <strong class="brand">epirig</strong>
      <Tabs />
      <Sequence />
      {ui && <BarStatus />}
      <ResultButtons />
      <span class="bar-buttons">
        <button type="button" onClick={() => (themeChoice.value = NEXT[themeChoice.value])}>
          <span class={ui ? 'long' : ''}>Theme: </span>
          {themeChoice.value}
        </button>
        <button type="button" onClick={() => (keySheetOpen.value = true)} aria-label="Keys">
          ?
        </button>
      </span>
      {ui && (
        <div class="stop-bar">
          <span class="stop-words">
            <StageWords />
          </span>
          <StopButton />
        </div>
      )}
    </header>
  );
}
