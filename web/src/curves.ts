// Curves, drawn by uPlot. A chunk of its own, so that the map is there before the curves are.

import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { HEIGHT, type CurveProps } from './components/CurvePanel';
import type { Palette } from './components/palette';
import { decades } from './format/decades';

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

function drawPlaces(plot: uPlot, places: number[], colours: Palette): void {
  const { ctx: context, bbox } = plot;
  context.save();
  context.strokeStyle = context.fillStyle = colours.text;
  context.lineWidth = devicePixelRatio;
  context.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
  context.textBaseline = 'top';
  places.forEach((place, index) => {
    const at = plot.valToPos(place, 'x', true);
    context.beginPath();
    context.moveTo(at, bbox.top);
    context.lineTo(at, bbox.top + bbox.height);
    context.stroke();
    context.fillText(String(index + 1), at + 3 * devicePixelRatio, bbox.top);
  });
  context.restore();
}

function optionsOf(props: CurveProps, width: number, colours: Palette): uPlot.Options {
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
    height: props.height ?? HEIGHT,
    // Half of the last label of x stands beyond the curve.
    padding: [8, 16, 0, 0],
    scales: { x: { time: false }, y: props.log ? LOGARITHMIC : { range: spanOf } },
    axes: [
      axisOf(props.xLabel, colours, false),
      { ...axisOf(props.yLabel, colours, true), ...(props.log ? LOGARITHMIC_AXIS : {}) },
    ],
    series: [xSeries, ...series],
    bands: props.band
      ? [{ series: [props.band[0] + 1, props.band[1] + 1], fill: `${colours.first}40` }]
      : [],
    legend: { show: props.legend ?? false, live: false },
    cursor: { y: false, drag: { setScale: false, x: false, y: false }, points: { size: 7 } },
    hooks: {
      draw: [
        (plot) => {
          if (props.mark) drawMark(plot, props.mark, colours);
          if (props.places) drawPlaces(plot, props.places, colours);
        },
      ],
      setCursor: [(plot) => props.onCursor?.(plot.cursor.left! >= 0 ? (plot.cursor.idx ?? null) : null)],
    },
  };
}

/** What falls as a power of the number of frames keeps its steepness to the end. */
const LOGARITHMIC: uPlot.Scale = {
  distr: 3,
  range: (_plot, low, high) => (low > 0 && high > 0 ? [low / 1.3, high * 1.3] : [0.001, 1]),
};

const LOGARITHMIC_AXIS: Partial<uPlot.Axis> = {
  splits: (_plot, _axis, low, high) => decades(low, high),
  filter: (_plot, splits) => splits,
};

/** The range of y; a flat curve lies in the middle of a small one. */
function spanOf(_plot: uPlot, low: number | null, high: number | null): uPlot.Range.MinMax {
  if (low === null || high === null) return [0, 1];
  if (low === high) return [low - 1, high + 1];
  return uPlot.rangeNum(low, high, 0.1, false);
}

/** Draws the curves into `box`. */
export function plotCurves(box: HTMLElement, props: CurveProps, colours: Palette): uPlot {
  const data = [props.x, ...props.curves.map((curve) => curve.values)] as uPlot.AlignedData;
  const plot = new uPlot(optionsOf(props, Math.max(box.clientWidth, 100), colours), data, box);
  const { onPick } = props;
  if (onPick) plot.over.addEventListener('click', (event) => onPick(plot.posToVal(event.offsetX, 'x')));
  return plot;
}
