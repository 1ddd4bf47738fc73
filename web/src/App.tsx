import { AppBar } from './components/AppBar';
import { ColourBar } from './components/ColourBar';
import { KeySheet } from './components/KeySheet';
import { StateBanner } from './components/StateBanner';
import { ToolBar } from './components/ToolBar';
import { ValueLine } from './components/ValueLine';
import { MapCanvas } from './map/MapCanvas';
import { Panels } from './panels/Panels';
import { ProfilePanel } from './panels/ProfilePanel';
import { loadError, results } from './store/results';

function ResultsView() {
  return (
    <main class="results">
      <div class="left">
        <ToolBar />
        <div class="map-row">
          <MapCanvas />
          <ColourBar />
        </div>
        <ValueLine />
        <ProfilePanel />
      </div>
      <Panels />
    </main>
  );
}

export function App() {
  return (
    <>
      <AppBar />
      <StateBanner />
      {results.value ? (
        <ResultsView />
      ) : (
        <main class="connecting">{loadError.value === null && <p role="status">connecting…</p>}</main>
      )}
      <KeySheet />
    </>
  );
}
