import { useEffect } from 'preact/hooks';
import type { RigState, ScanState } from '../rig/api';
import { rigState } from '../rig/store';
import '../style/main_button.css';
import '../style/scan.css';
import { AskedCard } from './AskedCard';
import { Fold } from './Fold';
import { JobCard, putAside } from './JobCard';
import { LiveMap } from './LiveMap';
import { PlanView } from './PlanView';
import { ScanLog } from './ScanLog';
import { ScanSide } from './ScanSide';
import { SigmaCourse } from './StopCharts';

function Scan({ scan, state, ended }: { scan: ScanState; state: RigState; ended: boolean }) {
  useEffect(() => {
    // A scan that was put aside and then resumed is of interest again.
    if (!ended) putAside.value = null;
  }, [ended]);
  return (
    <main class="scan">
      <h1 class="unseen">Scan</h1>
      <JobCard scan={scan} state={state} />
      {scan.asked ? <AskedCard asked={scan.asked} /> : <LiveMap scan={scan} />}
      <div class="scan-under">
        {scan.course.length > 0 && (
          <Fold title="Sigma against frames" brief="logarithmic">
            <SigmaCourse course={scan.course} />
          </Fold>
        )}
        <Fold title="Log" brief={state.log[state.log.length - 1]?.words ?? ''}>
          <ScanLog lines={state.log} />
        </Fold>
      </div>
      <ScanSide scan={scan} state={state} />
    </main>
  );
}

/** The scan: plan, progress, and the map that grows sharper with every stop. */
export function ScanView() {
  const state = rigState.value;
  if (!state) {
    return (
      <main class="scan">
        <h1 class="unseen">Scan</h1>
        <p class="hint" role="status">
          connecting…
        </p>
      </main>
    );
  }
  const { scan } = state;
  const ended = scan?.state === 'done' || scan?.state === 'failed';
  if (!scan || (ended && putAside.value === scan.name)) return <PlanView state={state} />;
  return <Scan scan={scan} state={state} ended={ended} />;
}
