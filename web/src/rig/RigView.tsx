import { ControlsPane, MoreControlsPane } from './ControlsPane';
import { DoctorPane } from './DoctorPane';
import { JobBar } from './JobBar';
import { FocusPane, HistogramPane } from './LightPane';
import { LivePicture } from './LivePicture';
import { LogList } from './LogList';
import { ProfileForm } from './ProfileForm';
import { openSection } from './profile_changes';
import { Section } from './Section';
import { SimulatedPane } from './SimulatedPane';
import { StagePane } from './StagePane';
import { TargetPane } from './TargetPane';

/** The rig by hand: what the camera sees, what the stage does. */
export function RigView() {
  return (
    <main class="rig">
      <h1 class="unseen">Rig</h1>
      <LivePicture />
      <div class="rig-column" tabIndex={-1}>
        <JobBar />
        <FocusPane />
        <StagePane />
        <ControlsPane />
        <HistogramPane />
        <DoctorPane />
        <TargetPane />
        <MoreControlsPane />
        <SimulatedPane />
        <Section title="Profile" open={openSection.value !== null}>
          <ProfileForm />
        </Section>
      </div>
      <LogList />
    </main>
  );
}
