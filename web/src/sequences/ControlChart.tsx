import { useEffect, useRef, useState } from 'preact/hooks';
import { moment } from '../format/moment';
import { measured } from '../format/number';
import type { SeriesChart } from '../types';
import { halfOf, layoutOf, MARGINS, unitOf, valueText, type Layout } from './chart';

const HEIGHT = 260;

/** What a value of the chart says. */
export function pointWords(chart: SeriesChart, index: number): string {
  const point = chart.points[index];
  if (!point) return '';
  const { sequence, begun, value, sigma, rules } = point;
  const unit = unitOf(chart);
  const told = sigma === null ? valueText(chart, value) : measured(value, sigma, unit);
  return `${sequence}, ${moment(begun)}: ${told}${rules.length > 0 ? `; ${rules.join('; ')}` : ''}`;
}

interface Drawn {
  chart: SeriesChart;
  layout: Layout;
  width: number;
}

/** A level from side to side, with its name at the right. */
function Level({ at, name, kind, width }: { at: number; name: string; kind: string; width: number }) {
  const right = width - MARGINS.right;
  return (
    <g class={kind}>
      <line x1={MARGINS.left} x2={right} y1={at} y2={at} />
      <text x={right + 4} y={at} dy="0.35em">
        {name}
      </text>
    </g>
  );
}

function Levels({ chart, layout: { y }, width }: Drawn) {
  const { mean, lower, upper, lower_limit, upper_limit } = chart;
  const inside = (at: number): boolean => at >= MARGINS.top - 1 && at <= HEIGHT - MARGINS.bottom + 1;
  const limits = [lower_limit, upper_limit]
    .filter((limit) => limit !== null)
    .map(y)
    .filter(inside);
  return (
    <>
      {limits.map((at) => (
        <Level key={at} at={at} name="limit" kind="tolerance" width={width} />
      ))}
      {upper > lower && <Level at={y(upper)} name="+3 s" kind="control" width={width} />}
      {upper > lower && <Level at={y(lower)} name={'\u22123 s'} kind="control" width={width} />}
      <Level at={y(mean)} name="mean" kind="mean" width={width} />
    </>
  );
}

function Axes({ chart, layout: { rows, columns }, width }: Drawn) {
  const [right, bottom] = [width - MARGINS.right, HEIGHT - MARGINS.bottom];
  const days = [chart.points[0], chart.points.at(-1)].map((point) =>
    moment(point?.begun ?? '').slice(0, 10),
  );
  return (
    <g class="axes">
      {rows.map(({ at, text }) => (
        <g key={text}>
          <line x1={MARGINS.left} x2={right} y1={at} y2={at} />
          <text x={MARGINS.left - 6} y={at} dy="0.35em" text-anchor="end">
            {text}
          </text>
        </g>
      ))}
      {columns.map(({ at, text }) => (
        <text key={text} x={at} y={bottom + 15} text-anchor="middle">
          {text}
        </text>
      ))}
      <text x={MARGINS.left} y={bottom + 32}>
        {days[0]}
      </text>
      <text x={right} y={bottom + 32} text-anchor="end">
        {days[1]}
      </text>
      <rect x={MARGINS.left} y={MARGINS.top} width={right - MARGINS.left} height={bottom - MARGINS.top} />
    </g>
  );
}

function Change({ chart, layout: { x, y }, width }: Drawn) {
  const { change } = chart;
  if (!change) return null;
  const at = (x(change.first - 1) + x(change.first)) / 2;
  return (
    <g class="change">
      <line x1={at} x2={at} y1={MARGINS.top} y2={HEIGHT - MARGINS.bottom} />
      <line x1={MARGINS.left} x2={at} y1={y(change.before)} y2={y(change.before)} />
      <line x1={at} x2={width - MARGINS.right} y1={y(change.after)} y2={y(change.after)} />
    </g>
  );
}

/** Values that are drawn with large marks; more would lie over each other. */
const FEW = 150;

/** All intervals are one path, and so are all values: a thousand are drawn as fast as ten. */
function Bars({ chart: { points }, layout: { x, y } }: Drawn) {
  const bars = points.map((point, index) => {
    const half = halfOf(point);
    return half === null ? '' : `M${x(index)} ${y(point.value - half)}V${y(point.value + half)}`;
  });
  return <path class={points.length > FEW ? 'bars many' : 'bars'} d={bars.join('')} />;
}

function Values({ chart: { points }, layout: { x, y } }: Drawn) {
  const radius = points.length > FEW ? 2 : 3.2;
  const dot = (index: number, value: number, size: number): string =>
    `M${x(index) - size} ${y(value)}a${size} ${size} 0 1 0 ${2 * size} 0a${size} ${size} 0 1 0 ${-2 * size} 0`;
  const steady = points.map(({ value, rules }, index) =>
    rules.length === 0 ? dot(index, value, radius) : '',
  );
  // A shape of its own: marks are told apart without colour.
  const marked = points.map(({ value, rules }, index) => {
    if (rules.length === 0) return '';
    const size = radius + 3;
    return `M${x(index)} ${y(value) - size}l${size} ${size}l${-size} ${size}l${-size} ${-size}z`;
  });
  return (
    <>
      <path
        class="line"
        d={points.map(({ value }, index) => `${index ? 'L' : 'M'}${x(index)} ${y(value)}`).join('')}
      />
      <path class="steady" d={steady.join('')} />
      <path class="marked" d={marked.join('')} />
    </>
  );
}

interface Props {
  chart: SeriesChart;
  /** What the chart is of. */
  name: string;
  /** The value that is pointed at. */
  at: number | null;
  point: (index: number) => void;
  open: (index: number) => void;
}

/** A control chart. Arrow keys go from value to value; a click, or Enter, opens the sequence. */
export function ControlChart({ chart, name, at, point, open }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const byFinger = useRef(false);
  const [width, setWidth] = useState(0);
  useEffect(() => {
    const observer = new ResizeObserver(() => setWidth(box.current!.clientWidth));
    observer.observe(box.current!);
    return () => observer.disconnect();
  }, []);
  const count = chart.points.length;
  const layout = layoutOf(chart, width, HEIGHT);
  const drawn = { chart, layout, width };
  const now = at ?? count - 1;
  const indexOf = (event: MouseEvent): number =>
    layout.nearest(event.clientX - box.current!.getBoundingClientRect().left);
  const onKeyDown = (event: KeyboardEvent): void => {
    const to = { ArrowLeft: now - 1, ArrowRight: now + 1, Home: 0, End: count - 1 }[event.key];
    if (event.key === 'Enter') open(now);
    else if (to !== undefined) point(Math.min(Math.max(to, 0), count - 1));
    else return;
    event.preventDefault();
  };
  const held = at === null ? undefined : chart.points[at];
  return (
    <div
      ref={box}
      class="control-chart"
      tabIndex={0}
      role="slider"
      aria-label={`${name}, value by value; Enter opens the sequence`}
      aria-valuemin={1}
      aria-valuemax={count}
      aria-valuenow={now + 1}
      aria-valuetext={pointWords(chart, now)}
      style={{ height: `${HEIGHT}px` }}
      onKeyDown={onKeyDown}
      onPointerDown={(event) => (byFinger.current = event.pointerType === 'touch')}
      onPointerMove={(event) => event.pointerType !== 'touch' && point(indexOf(event))}
      onClick={(event) => {
        point(indexOf(event));
        // A finger first asks what is there; the words have a button to open it.
        if (!byFinger.current) open(indexOf(event));
      }}
    >
      {width > 0 && (
        <svg width={width} height={HEIGHT} aria-hidden="true">
          <clipPath id="chart-inside">
            <rect
              x={MARGINS.left}
              y={MARGINS.top}
              width={Math.max(width - MARGINS.left - MARGINS.right, 0)}
              height={HEIGHT - MARGINS.top - MARGINS.bottom}
            />
          </clipPath>
          <Axes {...drawn} />
          <g clip-path="url(#chart-inside)">
            <Bars {...drawn} />
          </g>
          <Levels {...drawn} />
          <g clip-path="url(#chart-inside)">
            <Change {...drawn} />
            <Values {...drawn} />
            {held && <circle class="pointed" cx={layout.x(at!)} cy={layout.y(held.value)} r="9" />}
          </g>
        </svg>
      )}
    </div>
  );
}
