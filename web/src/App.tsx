import { signal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { AnswerCard } from './components/AnswerCard';
import { AppBar } from './components/AppBar';
import { ColourBar } from './components/ColourBar';
import { KeySheet } from './components/KeySheet';
import { LevelNote } from './components/LevelNote';
import { Notices } from './components/Notices';
import { StateBanner } from './components/StateBanner';
import { ToolBar } from './components/ToolBar';
import { ValueLine } from './components/ValueLine';
import { View3dPane } from './components/View3dPane';
import { inSolid } from './map/field';
import { MapCanvas } from './map/MapCanvas';
import { Panels } from './panels/Panels';
import { ProfilePanel } from './panels/ProfilePanel';
import { about, loadError, results } from './store/results';
import { view } from './store/route';

function ResultsView() {
  return (
    <main class="results">
      <h1 class="unseen">Results</h1>
      <div class="left">
        <AnswerCard />
        <ToolBar />
        <LevelNote />
        <div class="map-row">
          {inSolid.value ? <View3dPane /> : <MapCanvas />}
          <ColourBar />
        </div>
        <ValueLine />
        <ProfilePanel />
      </div>
      <Panels />
    </main>
  );
}

function Connecting() {
  return <main class="connecting">{loadError.value === null && <p role="status">connecting…</p>}</main>;
}

type Views = typeof import('./views');

/** The views of a rig, once they are loaded. If the server is gone meanwhile, the banner says so. */
const views = signal<Views | null>(null);

function OfRig({ name }: { name: 'RigView' | 'ScanView' | 'SequencesView' }) {
  useEffect(() => {
    import('./views').then(
      (loaded) => (views.value = loaded),
      () => undefined,
    );
  }, []);
  const Loaded = views.value?.[name];
  return Loaded ? <Loaded /> : <Connecting />;
}

function Shown() {
  if (view.value === 'rig') return <OfRig name="RigView" />;
  if (view.value === 'scan') return <OfRig name="ScanView" />;
  if (view.value === 'sequences') return <OfRig name="SequencesView" />;
  if (results.value) return <ResultsView />;
  const { mode, sequence } = about.value ?? {};
  // Which one to look at, while none is open.
  return mode === 'ui' && sequence === null ? <OfRig name="SequencesView" /> : <Connecting />;
}

export function App() {
  return (
    <>
      <AppBar />
      <StateBanner />
      <Notices />
      <Shown />
      <KeySheet />
    </>
  );
}
