import { api } from '../api';
import { rigBanner } from '../rig/RigBanner';
import { lostSince } from '../store/contact';
import { load, loadError, results } from '../store/results';
import { mode, view } from '../store/route';
import { Seconds } from './Seconds';

function LostBanner({ since }: { since: number }) {
  return (
    <div class="banner error" role="alert">
      <span aria-hidden="true">✕</span>
      <span>
        Server gone: no contact for <Seconds since={since} /> s. What is loaded stays readable.
      </span>
      <button type="button" onClick={() => void api.about().catch(() => undefined)}>
        Retry
      </button>
    </div>
  );
}

/** One place under the bar for what is wrong, the worst first. */
export function StateBanner() {
  const ofRig = mode.value === 'ui' ? rigBanner() : null;
  if (ofRig) return ofRig;
  if (lostSince.value !== null) return <LostBanner since={lostSince.value} />;
  if (loadError.value !== null) {
    return (
      <div class="banner error" role="alert">
        <span aria-hidden="true">✕</span>
        <span>{loadError.value}</span>
        <button type="button" onClick={() => void load()}>
          Retry
        </button>
      </div>
    );
  }
  if (view.value !== 'results') return null;
  const held = results.value;
  if (!held) return null;
  const none = 'This sequence has no results yet. Run epirig match; the frames can be looked at here.';
  const words = held.unfit ?? (held.results ? held.sequence.end_in_words : none);
  if (!words) return null;
  return (
    <div class="banner warn" role="status">
      <span aria-hidden="true">!</span>
      <span>{words}</span>
    </div>
  );
}
