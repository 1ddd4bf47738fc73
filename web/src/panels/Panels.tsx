import type { ComponentType } from 'preact';
import { useEffect, useRef } from 'preact/hooks';
import { results } from '../store/results';
import { panel, select } from '../store/selection';
import { CalibrationPanel } from './CalibrationPanel';
import { ComparePanel } from './ComparePanel';
import { DownloadsPanel } from './DownloadsPanel';
import { FramesPanel } from './FramesPanel';
import { PixelPanel } from './PixelPanel';
import { RegionPanel } from './RegionPanel';
import { RowCostPanel } from './RowCostPanel';
import { StagePanel } from './StagePanel';
import { StepsPanel } from './StepsPanel';
import { SummaryPanel } from './SummaryPanel';

const PANELS: [id: string, title: string, panel: ComponentType][] = [
  ['pixel', 'Pixel', PixelPanel],
  ['region', 'Region', RegionPanel],
  ['steps', 'Steps', StepsPanel],
  ['row-cost', 'Row cost', RowCostPanel],
  ['frames', 'Frames', FramesPanel],
  ['compare', 'Compare', ComparePanel],
  ['stage', 'Stage', StagePanel],
  ['calibration', 'Calibration', CalibrationPanel],
  ['downloads', 'Downloads', DownloadsPanel],
  ['about', 'About', SummaryPanel],
];

/** Tabs as screen readers know them: arrow keys move between them. */
function onTabKey(event: KeyboardEvent): void {
  const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (by === undefined) return;
  event.preventDefault();
  const now = PANELS.findIndex(([id]) => id === panel.peek());
  const next = PANELS[(now + by + PANELS.length) % PANELS.length]!;
  select({ panel: next[0] });
  document.getElementById(`tab-${next[0]}`)?.focus();
}

export function Panels() {
  // On narrow screens the tabs scroll sideways.
  const list = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const shown = list.current?.querySelector<HTMLElement>('[aria-selected=true]');
    if (!list.current || !shown) return;
    list.current.scrollLeft = shown.offsetLeft - (list.current.clientWidth - shown.offsetWidth) / 2;
  }, [panel.value]);

  const [id, title, Shown] = PANELS.find(([name]) => name === panel.value) ?? PANELS[0]!;
  return (
    <div class="panels">
      <div ref={list} class="tabs" role="tablist" aria-label="Panels" onKeyDown={onTabKey}>
        {PANELS.map(([name, words]) => (
          <button
            key={name}
            type="button"
            role="tab"
            id={`tab-${name}`}
            aria-selected={name === id}
            aria-controls="panel"
            tabIndex={name === id ? 0 : -1}
            onClick={() => select({ panel: name })}
          >
            {words}
          </button>
        ))}
      </div>
      <div class="panel" role="tabpanel" id="panel" aria-label={title} tabIndex={0}>
        {/* Other results: what was asked of the former ones is asked again. */}
        <Shown key={`${id} ${results.value?.id ?? ''}`} />
      </div>
    </div>
  );
}
