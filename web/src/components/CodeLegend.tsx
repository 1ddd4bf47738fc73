import type { MatchInfo } from '../api';
import type { Code } from '../colours/codes';
import { percent } from '../format/number';
import { results } from '../store/results';

/** Shares of the codes of the mask; other maps of codes have none. */
function sharesOf(mapId: string, matched: MatchInfo | null | undefined): (number | undefined)[] {
  if (mapId !== 'mask' || !matched) return [];
  const { answered, leaves_image, beyond_range, no_texture, occluded, ambiguous, outside } = matched;
  return [answered, leaves_image, beyond_range, no_texture, occluded, ambiguous, outside];
}

/** What the patterns of a map of codes mean, and how often each occurs. */
export function CodeLegend({ mapId, codes }: { mapId: string; codes: Code[] }) {
  const shares = sharesOf(mapId, results.value?.results);
  return (
    <ul class="legend" aria-label="Codes">
      {codes.map(({ code, words, pattern, grey }) => {
        const share = shares[code];
        return (
          <li key={code}>
            <span
              class={`swatch pattern-${pattern}`}
              style={{ backgroundColor: `rgb(${grey * 255} ${grey * 255} ${grey * 255})` }}
            />
            <span>
              {words}
              {share !== undefined && <small> {percent(share)}</small>}
            </span>
          </li>
        );
      })}
    </ul>
  );
}
