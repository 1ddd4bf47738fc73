import type { Code } from '../colours/codes';
import { percent } from '../format/number';

/** What the patterns of a map of codes mean, and how often each occurs. */
export function CodeLegend({ codes }: { codes: Code[] }) {
  return (
    <ul class="legend" aria-label="Codes">
      {codes.map(({ code, name, share, pattern, grey }) => (
        <li key={code}>
          <span
            class={`swatch pattern-${pattern}`}
            style={{ backgroundColor: `rgb(${grey * 255} ${grey * 255} ${grey * 255})` }}
          />
          <span>
            {name}
            <small> {percent(share)}</small>
          </span>
        </li>
      ))}
    </ul>
  );
}
