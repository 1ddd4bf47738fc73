import { significant } from '../format/number';
import type { TargetState } from './api';
import { OrderButton } from './OrderButton';
import { Section } from './Section';
import { onlyWatches, rigState } from './store';
import { looking, toggleTarget } from './targeting';
import { whyNoCamera } from './why';

/** Parts of the picture in which corners have been seen. */
function Coverage({ target }: { target: TargetState }) {
  const { coverage, coverage_columns, coverage_rows } = target;
  const seen = coverage.filter(Boolean).length;
  return (
    <>
      <div
        class="coverage"
        role="img"
        aria-label={`Coverage: corners seen in ${seen} of ${coverage.length} parts`}
        style={{
          gridTemplateColumns: `repeat(${coverage_columns}, 1fr)`,
          aspectRatio: `${coverage_columns * 4} / ${coverage_rows * 3}`,
        }}
      >
        {coverage.map((covered, index) => (
          <span key={index} class={covered ? 'covered' : ''}>
            {covered ? '✓' : ''}
          </span>
        ))}
      </div>
      <p>
        {seen === coverage.length
          ? 'all parts of the picture are covered'
          : `still wanted: the ${coverage.length - seen} empty parts`}
      </p>
    </>
  );
}

/** The chess-board in the picture. */
export function TargetPane() {
  const target = rigState.value?.target ?? null;
  if (!target && onlyWatches.value) return null;
  return (
    <Section title="Target">
      <p class="buttons">
        <OrderButton act={toggleTarget} why={whyNoCamera.value} pressed={looking.value}>
          Find target
        </OrderButton>
        {target && (
          <span>
            {target.complete ? '✓ ' : ''}
            {target.name}: corners {target.corners.length} of {target.wanted}
            {target.blur_px !== null && `, blur ${significant(target.blur_px, 2)} px`}
          </span>
        )}
      </p>
      {target && <Coverage target={target} />}
    </Section>
  );
}
