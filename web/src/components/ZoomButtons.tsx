import { handleOf } from '../map/handle';

export function ZoomButtons() {
  return (
    <div class="zoom" role="group" aria-label="Zoom">
      <button type="button" aria-label="Zoom out" onClick={() => handleOf.value?.zoomBy(1 / 1.5)}>
        {'\u2212'}
      </button>
      <button type="button" aria-label="Show all" onClick={() => handleOf.value?.fit()}>
        all
      </button>
      <button type="button" aria-label="Zoom in" onClick={() => handleOf.value?.zoomBy(1.5)}>
        +
      </button>
    </div>
  );
}
