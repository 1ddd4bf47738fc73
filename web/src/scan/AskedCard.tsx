import { rig, type Asked, type TargetState } from '../rig/api';
import { order, rigState } from '../rig/store';
import { CameraPicture } from './CameraPicture';
import { whyNot } from './control';
import { Order, Reason } from './JobCard';

const TITLES: Record<Asked['kind'], string> = {
  object: 'The object',
  dark: 'Dark frames',
  flat: 'Flat field',
  board: 'Chess-board',
};

/** In which parts of the picture the board has been seen. */
function Coverage({ target }: { target: TargetState }) {
  const seen = target.coverage.filter(Boolean).length;
  return (
    <div class="coverage">
      <div
        role="img"
        aria-label={`Coverage: ${seen} of ${target.coverage.length} parts of the picture`}
        style={{ gridTemplateColumns: `repeat(${target.coverage_columns}, 1fr)` }}
      >
        {target.coverage.map((covered, part) => (
          <span key={part} class={covered ? 'covered' : ''}>
            {covered ? '✓' : ''}
          </span>
        ))}
      </div>
      <p class="note">
        corners found {target.corners.length} of {target.wanted}
        <br />
        <span class="muted">
          {seen} of {target.coverage.length} parts of the picture covered
        </span>
      </p>
    </div>
  );
}

/** What the scan asks a person to put before the camera. */
export function AskedCard({ asked }: { asked: Asked }) {
  const target = rigState.value?.target;
  const { kind, words, pose, poses, by_itself, waiting_for } = asked;
  return (
    <section class="scan-map scan-asked" aria-label="What to do">
      <h2>
        {TITLES[kind]}
        {pose !== null && poses !== null && (
          <span class="muted">
            {' '}
            pose {pose} of {poses}
          </span>
        )}
      </h2>
      <p class="asked-words" role="status">
        {words}
      </p>
      {by_itself && (
        <p class="asked-wait">
          The shot is taken by itself when the board is still.
          {waiting_for && <b> Waiting for: {waiting_for}.</b>}
        </p>
      )}
      <div class="scan-buttons">
        <Order main reason={whyNot.value} onClick={() => void order(rig.arranged(true))}>
          Done, take it
        </Order>
        <Order reason={whyNot.value} onClick={() => void order(rig.arranged(false))}>
          Cancel
        </Order>
      </div>
      <Reason words={whyNot.value} />
      <div class="asked-look">
        <CameraPicture name="Live picture" live />
        {target && target.coverage.length > 0 && <Coverage target={target} />}
      </div>
    </section>
  );
}
