import { results } from '../store/results';
import { select } from '../store/selection';
import { VERDICT_COLOURS } from './verdict';

/** What was measured of the surface, before anything else: verdict, depth with its interval, and limits or plan in words. */
export function AnswerCard() {
  const surface = results.value?.surface;
  if (!surface) return null;
  const { depth, sentence, verdict, verdict_sentence } = surface.conclusion;
  const typographic = (text: string): string => text.replaceAll('+-', '±');
  return (
    <section class={`answer ${verdict ? VERDICT_COLOURS[verdict] : ''}`} aria-label="Answer">
      {verdict && <strong class="verdict">{verdict.toUpperCase()}</strong>}
      {depth && <strong>{typographic(depth)}</strong>}
      <p>{typographic(verdict_sentence ?? sentence)}</p>
      <button type="button" onClick={() => select({ panel: 'steps' })}>
        Details
      </button>
    </section>
  );
}
