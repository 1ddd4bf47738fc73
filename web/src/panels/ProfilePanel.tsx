import { useMemo, useRef, useState } from 'preact/hooks';
import { api, type LineInfo, type LinePoint } from '../api';
import { CurvePanel, type Curve } from '../components/CurvePanel';
import { NumberField } from '../components/NumberField';
import { save } from '../store/actions';
import { refuse } from '../store/notices';
import { profile } from '../store/questions';
import { lengths, results } from '../store/results';
import { drawing, hover, line, select } from '../store/selection';
import { moved, within, type Cursors } from './between';
import { ProfileCursors } from './ProfileCursors';

interface Columns {
  x: number[];
  curves: Curve[];
  points: LinePoint[];
}

/** The points as columns for the plot; `factor` is the length that is shown over one in mm. */
function columnsOf(info: LineInfo, factor: number): Columns {
  const shifted =
    (sign: number) =>
    (point: LinePoint): number | null => {
      const [middle, half] = [point.height_mm, point.sigma_mm];
      return middle === null || half === null ? null : (middle + sign * half) * factor;
    };
  return {
    x: info.points.map((point) => point.distance_mm),
    points: info.points,
    curves: [
      { label: 'value + sigma', values: info.points.map(shifted(1)), tone: 'muted', width: 0.5 },
      { label: 'value − sigma', values: info.points.map(shifted(-1)), tone: 'muted', width: 0.5 },
      {
        label: 'height',
        values: info.points.map(({ height_mm }) => (height_mm === null ? null : height_mm * factor)),
        tone: 'first',
        width: 1.8,
      },
    ],
  };
}

/** The point of the line nearest to the pixel under the pointer, if that is close to the line. */
function nearest(points: LinePoint[], at: { x: number; y: number } | null): number | null {
  if (!at) return null;
  let best: number | null = null;
  let least = 12;
  points.forEach((point, index) => {
    const distance = Math.hypot(point.x_px - at.x, point.y_px - at.y);
    if (distance < least) [best, least] = [index, distance];
  });
  return best;
}

export function ProfilePanel() {
  // While a line is drawn the panel keeps its size, or the map would move under the pointer.
  const drawn = useRef(line.peek());
  if (!drawing.value) drawn.current = line.value;
  const ends = drawn.current;
  const { value: info, error, loading } = profile.state.value;
  const { label, factor } = lengths.value;
  const [put, setCursors] = useState<Cursors | null>(null);
  const columns = useMemo(() => info && columnsOf(info, factor), [info, factor]);
  // Another line may be shorter.
  const cursors = useMemo(() => put && columns && within(put, columns.x), [put, columns]);
  if (!results.value?.results) return null;
  if (!ends) {
    return (
      <section class="profile" aria-label="Profile">
        <p class="hint">Profile: Shift + drag on the map, or "Draw line", draws a line A–B.</p>
      </section>
    );
  }
  const csv = async (): Promise<void> => {
    try {
      save(await api.lineCsv({ ...ends }), 'profile.csv');
    } catch (fault) {
      refuse(fault);
    }
  };
  return (
    <section class="profile" aria-label="Profile">
      <div class="profile-head">
        <h3>
          Profile A–B
          <span class="muted">
            {' '}
            ({ends.x0}, {ends.y0}) to ({ends.x1}, {ends.y1}) px; band ± sigma (k = 1)
          </span>
        </h3>
        <NumberField
          label="width"
          unit="px"
          buttons
          minimum={1}
          maximum={128}
          step={2}
          value={ends.width}
          onChange={(width) => select({ line: { ...ends, width: Math.round(width) } })}
        />
        <button type="button" onClick={() => void csv()}>
          CSV
        </button>
        <button type="button" onClick={() => select({ line: null })}>
          Clear
        </button>
      </div>
      {error && <p class="fault">{error}</p>}
      {columns && !error && (
        <div class={loading ? 'loading' : ''}>
          <CurvePanel
            name={`Profile from A to B, height in ${label}`}
            xLabel="distance (mm)"
            yLabel={`height (${label})`}
            x={columns.x}
            curves={columns.curves}
            band={[0, 1]}
            height={150}
            cursor={nearest(columns.points, hover.value)}
            onCursor={(index) => {
              const point = index === null ? undefined : columns.points[index];
              hover.value = point ? { x: Math.round(point.x_px), y: Math.round(point.y_px) } : null;
            }}
            places={cursors}
            onPick={(at) => cursors && setCursors(moved(cursors, at))}
          />
          <ProfileCursors points={columns.points} cursors={cursors} onChange={setCursors} />
        </div>
      )}
    </section>
  );
}
