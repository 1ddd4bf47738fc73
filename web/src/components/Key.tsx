import type { Curve } from './CurvePanel';

/** The key of curves: a stroke with its dash pattern and its name. */
export function Key({ curves }: { curves: Curve[] }) {
  return (
    <ul class="key-list">
      {curves.map(({ label, dash, tone, width }) => (
        <li key={label}>
          <svg width="28" height="8" aria-hidden="true">
            <line
              x1="0"
              x2="28"
              y1="4"
              y2="4"
              stroke={`var(--${tone})`}
              stroke-width={width ?? 1.5}
              stroke-dasharray={dash?.join(' ')}
            />
          </svg>
          {label}
        </li>
      ))}
    </ul>
  );
}
