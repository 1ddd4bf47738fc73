import { useEffect, useRef } from 'preact/hooks';
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { palette } from '../store/settings';
import type { Palette } from './palette';

export interface Curve {
  label: string;
  values: (number | null)[];
  /** Dash pattern first, colour second: curves are told apart without colour. */
  dash?: number[];
  tone: 'first' | 'second' | 'muted';
  width?: number;
  points?: boolean;
}

interface Props {
  /** What the picture shows, for those who do not see it. */
  name: string;
  xLabel: string;
  yLabel: string;
  x: number[];
  curves: Curve[];
  /** Indices of two curves, upper first, with the space between them filled. */
  band?: [upper: number, lower: number];
  /** A vertical line and a band around it, in units of x. */
  mark?: { at: number; half: number } | null;
  height?: number;
  /** Index of the nearest point while the pointer is over the plot, else null. */
  onCursor?: (index: number | null) => void;
  /** Index to mark because another pane points at it. */
  cursor?: number | null;
  legend?: boolean;
}

function tick(values: number[]): string[] {
  return values.map((value) => String(Number(value.toPrecision(6))).replace('-', '\u2212'));
}

function axisOf(label: string, colours: Palette, vertical: boolean): uPlot.Axis {
  return {
    label,
    stroke: colours.muted,
    grid: { stroke: colours.hair, width: 1 },
    ticks: { stroke: colours.edge, width: 1, size: 4 },
    font: '12px system-ui, sans-serif',
    labelFont: '12px system-ui, sans-serif',
    labelSize: 18,
    labelGap: 0,
    gap: 3,
    space: vertical ? 24 : 60,
    size: vertical
      ? (_plot, values) => 14 + 7 * Math.max(2, ...(values ?? []).map((text) => text.length))
      : 26,
    values: (_plot, values) => tick(values),
  };
}

function drawMark(plot: uPlot, mark: { at: number; half: number }, colours: Palette): void {
  const { ctx: context, bbox } = plot;
  const at = plot.valToPos(mark.at, 'x', true);
  const half = Math.abs(plot.valToPos(mark.at + mark.half, 'x', true) - at);
  context.save();
  context.fillStyle = `${colours.second}44`;
  context.fillRect(at - half, bbox.top, 2 * half, bbox.height);
  context.strokeStyle = colours.text;
  context.lineWidth = devicePixelRatio;
  context.setLineDash([6 * devicePixelRatio, 3 * devicePixelRatio]);
  context.beginPath();
  context.moveTo(at, bbox.top);
  context.lineTo(at, bbox.top + bbox.height);
  context.stroke();
  context.restore();
}

function optionsOf(props: Props, width: number, colours: Palette): uPlot.Options {
  const series = props.curves.map((curve): uPlot.Series => {
    const colour = curve.tone === 'muted' ? colours.muted : colours[curve.tone];
    return {
      label: curve.label,
      stroke: colour,
      width: curve.width ?? 1.5,
      ...(curve.dash ? { dash: curve.dash } : {}),
      points: { show: curve.points ?? false, size: 5, fill: colour },
      spanGaps: false,
      value: (_plot, value) => (value === null ? '' : tick([value])[0]!),
    };
  });
  const xSeries: uPlot.Series = {
    label: props.xLabel,
    value: (_plot, value) => (value === null ? '' : tick([value])[0]!),
  };
  return {
    width,
    height: props.height ?? 160,
    padding: [8, 10, 0, 0],
    scales: { x: { time: false } },
    axes: [axisOf(props.xLabel, colours, false), axisOf(props.yLabel, colours, true)],
    series: [xSeries, ...series],
    bands: props.band
      ? [{ series: [props.band[0] + 1, props.band[1] + 1], fill: `${colours.first}40` }]
      : [],
    legend: { show: props.legend ?? false, live: false },
    cursor: { y: false, drag: { setScale: false, x: false, y: false }, points: { size: 7 } },
    hooks: {
      draw: [(plot) => props.mark && drawMark(plot, props.mark, colours)],
      setCursor: [(plot) => props.onCursor?.(plot.cursor.left! >= 0 ? (plot.cursor.idx ?? null) : null)],
    },
  };
}

/** Curves with units on both axes. uPlot owns what is inside. */
export function CurvePanel(props: Props) {
  const place = useRef<HTMLDivElement>(null);
  const plot = useRef<uPlot | null>(null);
  const colours = palette.value;
  const { x, curves, mark, height, cursor } = props;

  useEffect(() => {
    const box = place.current;
    if (!box) return undefined;
    const data = [x, ...curves.map((curve) => curve.values)] as uPlot.AlignedData;
    const made = new uPlot(optionsOf(props, Math.max(box.clientWidth, 100), colours), data, box);
    plot.current = made;
    const observer = new ResizeObserver(() => {
      made.setSize({ width: Math.max(box.clientWidth, 100), height: props.height ?? 160 });
    });
    observer.observe(box);
    return () => {
      observer.disconnect();
      made.destroy();
      plot.current = null;
    };
  }, [x, curves, mark?.at, mark?.half, height, colours]);

  useEffect(() => {
    const held = plot.current;
    if (!held || cursor === undefined) return;
    const left = cursor === null ? -10 : held.valToPos(x[cursor] ?? 0, 'x');
    // Without the hook, or both panes would answer each other.
    held.setCursor({ left, top: 10 }, false);
  }, [cursor, x]);

  return <div ref={place} class="curve" role="img" aria-label={props.name} />;
}
