import { rigState } from './store';
import { positionText } from './texts';

/** What the stage does, in a few words beside STOP. */
export function StageWords() {
  const state = rigState.value;
  if (!state) return <>connecting</>;
  const { stage } = state;
  if (state.stopping) return <>stopping</>;
  if (stage.state !== 'ready') return <>stage {stage.state}</>;
  const place = stage.position_mm === null ? 'not homed' : positionText(stage.position_mm, stage.steps_mm);
  return (
    <>
      {stage.moving ? 'moves' : 'still'}, {place}
    </>
  );
}
