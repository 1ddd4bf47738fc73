import { useMemo, useRef, useState } from 'preact/hooks';
import { api, type LinePoint } from '../api';
import { CurvePanel } from '../components/CurvePanel';
import { NumberField } from '../components/NumberField';
import { takeCurves } from '../sheet/export';
import { save } from '../store/actions';
import { MOST_KEPT } from '../store/hash';
import { levelled, levelledBy } from '../store/levelled';
import { refuse } from '../store/notices';
import { keptProfiles, profile } from '../store/questions';
import { lengths, results } from '../store/results';
import {
  addsLine,
  drawing,
  dropLine,
  hover,
  lettersOf,
  line,
  select,
  selection,
  tool,
} from '../store/selection';
import { moved, pointAt, within, type Cursors } from './between';
import { ProfileCursors } from './ProfileCursors';
import { profilesOf } from './profiles';

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

const nameOf = (index: number): string => lettersOf(index).join('–');

/** The lines that stay, each with its way out. */
function Kept() {
  const { kept } = selection.value;
  if (kept.length === 0) return null;
  return (
    <ul class="kept-lines" aria-label="Other lines">
      {kept.map(({ x0, y0, x1, y1, width }, index) => (
        <li key={nameOf(index)}>
          <span class={`dash dash-${index}`} aria-hidden="true" /> {nameOf(index)} ({x0}, {y0}) to ({x1},{' '}
          {y1}
          ), width {width} px{' '}
          <button type="button" aria-label={`Remove ${nameOf(index)}`} onClick={() => dropLine(index)}>
            Remove
          </button>
        </li>
      ))}
    </ul>
  );
}

export function ProfilePanel() {
  // While a line is drawn the panel keeps its size, or the map would move under the pointer.
  const drawn = useRef(line.peek());
  if (!drawing.value) drawn.current = line.value;
  const ends = drawn.current;
  const canvas = useRef<HTMLCanvasElement>(null);
  const { value: info, error, loading } = profile.state.value;
  const others = keptProfiles.state.value;
  const { kept } = selection.value;
  const { label, factor } = lengths.value;
  const [put, setCursors] = useState<Cursors | null>(null);
  const columns = useMemo(() => {
    const there = others.value?.length === kept.length ? others.value : [];
    const names = [...there, info].map((_info, index) => nameOf(index));
    return info && profilesOf(info, there, names, factor);
  }, [info, others.value, kept.length, factor]);
  // Another line may be shorter.
  const cursors = useMemo(
    () =>
      put &&
      columns &&
      within(
        put,
        columns.points.map(({ distance_mm }) => distance_mm),
      ),
    [put, columns],
  );
  if (!results.value?.results) return null;
  if (!ends) {
    return (
      <section class="profile" aria-label="Profile">
        <p class="hint">Profile: Shift + drag on the map, or "Draw line", draws a line A–B.</p>
      </section>
    );
  }
  const [from, to] = lettersOf(kept.length);
  const words = `(${ends.x0}, ${ends.y0}) to (${ends.x1}, ${ends.y1}) px; band ± sigma (k = 1)`;
  const levelWords = levelled.value?.words ?? null;
  const csv = async (): Promise<void> => {
    try {
      const levelled_by = levelledBy.peek();
      const name = levelled_by ? 'profile-levelled.csv' : 'profile.csv';
      save(await api.lineCsv({ ...ends, levelled_by }), name);
    } catch (fault) {
      refuse(fault);
    }
  };
  const png = (): void => {
    if (!canvas.current) return;
    const title = levelWords ? `Profile ${from}–${to}, ${levelWords}` : `Profile ${from}–${to}`;
    const dashed = kept.map(
      ({ x0, y0, x1, y1 }, index) => `${nameOf(index)}, dashed: (${x0}, ${y0}) to (${x1}, ${y1}) px`,
    );
    const picture = { picture: canvas.current, devicePixels: devicePixelRatio };
    void takeCurves(picture, title, [`${from}–${to}: ${words}`, ...dashed], 'profile');
  };
  const indexIn = (of: { own: number[] }, point: number | null): number | null =>
    point === null ? null : (of.own[point] ?? null);
  return (
    <section class="profile" aria-label="Profile">
      <div class="profile-head">
        <h3>
          Profile {from}–{to}
          <span class="muted">
            {' '}
            {words}
            {levelWords && `; ${levelWords}`}
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
        {kept.length < MOST_KEPT && (
          <button
            type="button"
            aria-pressed={addsLine.value}
            onClick={() => {
              addsLine.value = !addsLine.peek();
              tool.value = addsLine.peek() ? 'line' : 'pin';
            }}
          >
            Add line
          </button>
        )}
        <button type="button" onClick={() => void csv()}>
          CSV
        </button>
        <button type="button" aria-label="Profile as PNG" onClick={png}>
          PNG
        </button>
        <button type="button" onClick={() => dropLine(kept.length)}>
          Clear
        </button>
      </div>
      {(error ?? others.error) && <p class="fault">{error ?? others.error}</p>}
      {columns && !error && (
        <div class={loading || others.loading ? 'loading' : ''}>
          <CurvePanel
            name={`Profile from ${from} to ${to}, height in ${label}`}
            xLabel="distance (mm)"
            yLabel={`height (${label})`}
            x={columns.x}
            curves={columns.curves}
            band={[0, 1]}
            height={150}
            canvas={canvas}
            cursor={indexIn(columns, nearest(columns.points, hover.value))}
            onCursor={(index) => {
              const at = index === null ? undefined : columns.x[index];
              const point = at === undefined ? undefined : columns.points[pointAt(columns.points, at)];
              hover.value = point ? { x: Math.round(point.x_px), y: Math.round(point.y_px) } : null;
            }}
            places={cursors}
            onPick={(at) => cursors && setCursors(moved(cursors, at))}
          />
          <Kept />
          <ProfileCursors points={columns.points} cursors={cursors} onChange={setCursors} />
        </div>
      )}
    </section>
  );
}
