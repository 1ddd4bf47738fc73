import { useEffect, useState } from 'preact/hooks';
import { rig } from '../rig/api';
import { onlyWatches } from '../rig/store';
import { openResults } from '../scan/JobCard';
import { plural } from '../scan/words';
import type { SeriesChart, SeriesTrend, TrendQuestion } from '../types';
import { changeText, unitOf, valueText } from './chart';
import { ControlChart, pointWords } from './ControlChart';
import { measure, rows } from './store';

/** A person types a filter letter by letter. */
const PAUSE_MS = 300;

type Measure = TrendQuestion['measure'];

const nameOf = (of: Measure): string => of.replace('-', ' ');

interface Answer {
  trend: SeriesTrend | null;
  error: string | null;
  asking: boolean;
}

/** Asks for the quantity over the rows of the table, whenever either is another. */
function useTrend(): Answer {
  const [answer, setAnswer] = useState<Answer>({ trend: null, error: null, asking: true });
  const quantity = measure.value;
  const names = rows.value.map(({ name }) => name).sort();
  const of = names.join('\n');
  useEffect(() => {
    const here = new AbortController();
    setAnswer((before) => ({ ...before, asking: true }));
    const ask = (): void => {
      rig.trend({ measure: quantity, sequences: names }, here.signal).then(
        (trend) => setAnswer({ trend, error: null, asking: false }),
        (fault: unknown) => {
          if (here.signal.aborted) return;
          const error = fault instanceof Error ? fault.message : String(fault);
          setAnswer({ trend: null, error, asking: false });
        },
      );
    };
    const timer = setTimeout(ask, PAUSE_MS);
    return () => {
      clearTimeout(timer);
      here.abort();
    };
  }, [quantity, of]);
  return answer;
}

function Quantity({ trend }: { trend: SeriesTrend | null }) {
  const offered = trend?.offered.map((one) => one.measure) ?? [];
  const now = measure.value;
  const choices = offered.includes(now) ? offered : [now, ...offered];
  return (
    <label>
      quantity{' '}
      <select value={now} onChange={(event) => (measure.value = event.currentTarget.value as Measure)}>
        {choices.map((one) => (
          <option key={one} value={one}>
            {nameOf(one)}
          </option>
        ))}
      </select>
    </label>
  );
}

function Open({ name }: { name: string }) {
  if (onlyWatches.value) return <b>{name}</b>;
  return (
    <button type="button" class="plain" onClick={() => void openResults(name)}>
      {name}
    </button>
  );
}

/** The values that a steady process seldom has, and why. */
function Marked({ chart }: { chart: SeriesChart }) {
  const marked = chart.points.filter(({ rules }) => rules.length > 0);
  if (marked.length === 0) return <p>No value is marked: the process looks steady.</p>;
  return (
    <>
      <h3>{plural(marked.length, 'value')} marked</h3>
      <div class="marked-values" tabIndex={0} role="region" aria-label="Marked values">
        <ul>
          {marked.map(({ sequence, value, rules }) => (
            <li key={sequence}>
              <span class="diamond" aria-hidden="true">
                ◆
              </span>{' '}
              <Open name={sequence} /> {valueText(chart, value)}: {rules.join('; ')}
            </li>
          ))}
        </ul>
      </div>
    </>
  );
}

function Words({ chart }: { chart: SeriesChart }) {
  const change = changeText(chart);
  const { lower, upper, mean, lower_limit, upper_limit, points } = chart;
  const limits = [
    lower_limit !== null ? `from ${valueText(chart, lower_limit)}` : '',
    upper_limit !== null ? `to ${valueText(chart, upper_limit)}` : '',
  ].filter(Boolean);
  return (
    <>
      <p>
        {plural(points.length, 'sequence')}: mean {valueText(chart, mean)}, limits of control (mean ± 3
        scatter) {valueText(chart, lower)} to {valueText(chart, upper)}
        {limits.length > 0 && `; tolerance ${limits.join(' ')}`}. Bars are two standard uncertainties to
        each side, as far as they are known.
      </p>
      {change !== null && <p class="amber">{change}</p>}
    </>
  );
}

function Chart({ chart }: { chart: SeriesChart }) {
  const [at, setAt] = useState<number | null>(null);
  useEffect(() => setAt(null), [chart]);
  const held = at === null ? undefined : chart.points[at];
  const unit = unitOf(chart);
  const open = (index: number): void => {
    const point = chart.points[index];
    if (point && !onlyWatches.peek()) void openResults(point.sequence);
  };
  return (
    <>
      <p class="chart-words">
        {held ? (
          <>
            <Open name={held.sequence} />
            {pointWords(chart, at!).slice(held.sequence.length)}
          </>
        ) : (
          <span class="muted">
            {nameOf(chart.measure) + (unit && ` (${unit})`)}, in the order in which the sequences were begun
          </span>
        )}
      </p>
      <ControlChart
        chart={chart}
        name={`Control chart of ${nameOf(chart.measure)}`}
        at={at}
        point={setAt}
        open={open}
      />
      <Words chart={chart} />
      <Marked chart={chart} />
    </>
  );
}

/** One quantity over the sequences of the table, as a control chart. */
export function TrendPane() {
  const { trend, error, asking } = useTrend();
  const chart = trend?.chart ?? null;
  const meaning = trend?.offered.find((one) => one.measure === measure.value)?.meaning;
  return (
    <section class="trend-pane" aria-label="Control chart" aria-busy={asking}>
      <div class="trend-head">
        <h2>Control chart</h2>
        <Quantity trend={trend} />
      </div>
      {meaning !== undefined && <p class="hint">{meaning}</p>}
      {error !== null && <p class="fault">{error}</p>}
      {chart && (
        <div class={asking ? 'loading' : ''}>
          <Chart chart={chart} />
        </div>
      )}
      {trend && !chart && (
        <p class="hint">
          Fewer than two of these sequences have this quantity
          {trend.offered.length > 0
            ? '; choose another one.'
            : ': calibrate, match and measure them first.'}
        </p>
      )}
      {!trend && error === null && <p class="hint">loading…</p>}
      {trend && trend.problems.length > 0 && (
        <details>
          <summary>{plural(trend.problems.length, 'record')} could not be read</summary>
          <ul>
            {trend.problems.map((problem) => (
              <li key={problem}>{problem}</li>
            ))}
          </ul>
        </details>
      )}
    </section>
  );
}
