import type { Histogram } from '../api';
import type { Code } from '../colours/codes';
import { percent } from '../format/number';

/** What the patterns of a map of codes mean, and how often each occurs. */
export function CodeLegend({ codes, histogram }: { codes: Code[]; histogram: Histogram | null }) {
  const total = histogram?.counts.reduce((sum, count) => sum + count, 0) ?? 0;
  const shareOf = (code: number): number | null => {
    if (!histogram || total === 0) return null;
    const width = (histogram.high - histogram.low) / histogram.counts.length;
    let sum = 0;
    histogram.counts.forEach((count, bin) => {
      const middle = histogram.low + (bin + 0.5) * width;
      if (Math.round(middle) === code) sum += count;
    });
    return sum / total;
  };
  return (
    <ul class="legend" aria-label="Codes">
      {codes.map(({ code, words, pattern, grey }) => {
        const share = shareOf(code);
        return (
          <li key={code}>
            <span
              class={`swatch pattern-${pattern}`}
              style={{ backgroundColor: `rgb(${grey * 255} ${grey * 255} ${grey * 255})` }}
            />
            <span>
              {words}
              {share !== null && <small> {percent(share)}</small>}
            </span>
          </li>
        );
      })}
    </ul>
  );
}
