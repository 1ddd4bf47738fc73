import { pictureOf } from '../map/handle';
import { takeView } from '../sheet/export';

/** The map or the surface as a picture file. */
export function TakeButton() {
  return (
    <button type="button" class="take" disabled={!pictureOf.value} onClick={() => void takeView()}>
      PNG
    </button>
  );
}
