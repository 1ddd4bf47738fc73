import { useSignal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { api } from '../api';
import { lostSince } from '../store/contact';
import { load, loadError, results } from '../store/results';

function LostBanner({ since }: { since: number }) {
  const now = useSignal(Date.now());
  useEffect(() => {
    const timer = setInterval(() => (now.value = Date.now()), 1000);
    return () => clearInterval(timer);
  }, []);
  const seconds = Math.max(0, Math.round((now.value - since) / 1000));
  return (
    <div class="banner error" role="alert">
      <span aria-hidden="true">✕</span>
      {/* The count is not read out each second. */}
      <span>
        Server gone: no contact for <span aria-hidden="true">{seconds}</span> s. What is loaded stays
        readable.
      </span>
      <button type="button" onClick={() => void api.about().catch(() => undefined)}>
        Retry
      </button>
    </div>
  );
}

/** One place under the bar for what is wrong, the worst first. */
export function StateBanner() {
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
  const held = results.value;
  if (held && !held.results) {
    return (
      <div class="banner warn" role="status">
        <span aria-hidden="true">!</span>
        <span>This sequence has no results yet. Run epirig match; the frames can be looked at here.</span>
      </div>
    );
  }
  if (held?.sequence.end_in_words) {
    return (
      <div class="banner warn" role="status">
        <span aria-hidden="true">!</span>
        <span>{held.sequence.end_in_words}</span>
      </div>
    );
  }
  return null;
}
