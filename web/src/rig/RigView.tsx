import { ControlsPane, MoreControlsPane } from './ControlsPane';
import { DoctorPane } from './DoctorPane';
import { JobBar } from './JobBar';
import { FocusPane, HistogramPane } from './LightPane';
import { LivePicture } from './LivePicture';
import { LogList } from './LogList';
import { ProfileForm } from './ProfileForm';
import { Section } from './Section';
import { SimulatedPane } from './SimulatedPane';
import { StagePane } from './StagePane';
import { TargetPane } from './TargetPane';
import { rigState, tries } from './store';
import { whyNoOrders, whyWatching } from './why';

/** Why buttons are off, said once for all of them. */
function WhyOff() {
  if (rigState.value?.task && whyWatching.value === null && tries.value === 0) return null;
  const why = whyNoOrders.value;
  return why === null ? null : <p class="why muted">Controls are off: {why}.</p>;
}

/** The rig by hand: what the camera sees, what the stage does. */
export function RigView() {
  return (
    <main class={`rig ${rigState.value ? '' : 'skeleton'}`}>
      <h1 class="unseen">Rig</h1>
      <LivePicture />
      <div class="rig-column" tabIndex={-1}>
        <JobBar />
        <WhyOff />
        <FocusPane />
        <HistogramPane />
        <ControlsPane />
        <StagePane />
        <DoctorPane />
        <TargetPane />
        <MoreControlsPane />
        <SimulatedPane />
        <Section title="Profile" open={false}>
          <ProfileForm />
        </Section>
      </div>
      <LogList />
    </main>
  );
}
