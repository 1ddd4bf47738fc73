import { useEffect, useRef, useState } from 'preact/hooks';
import type uPlot from 'uplot';
import { palette } from '../store/settings';

export interface Curve {
  label: string;
  /** `null` is a gap; at `undefined` another curve has its point. */
  values: (number | null | undefined)[];
  /** Dash pattern first, colour second: curves are told apart without colour. */
  dash?: number[];
  tone: 'first' | 'second' | 'muted';
  width?: number;
  points?: boolean;
}

export interface CurveProps {
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
  /** Whether y is logarithmic: for values above 0. */
  log?: boolean;
  height?: number;
  /** Index of the nearest point while the pointer is over the plot, else null. */
  onCursor?: (index: number | null) => void;
  /** Index to mark because another pane points at it. */
  cursor?: number | null;
  legend?: boolean;
  /** Vertical lines that are numbered from 1, in units of x. */
  places?: number[] | null;
  /** Where the drawn canvas is put, to make a picture of it. */
  canvas?: { current: HTMLCanvasElement | null };
  /** The place in units of x that was clicked. */
  onPick?: (at: number) => void;
}

/** Height in px of the page, unless told otherwise. */
export const HEIGHT = 160;

type Drawing = typeof import('../curves');

/** Curves with units on both axes. uPlot owns what is inside. */
export function CurvePanel(props: CurveProps) {
  const place = useRef<HTMLDivElement>(null);
  const plot = useRef<uPlot | null>(null);
  const [drawing, setDrawing] = useState<Drawing | null>(null);
  useEffect(() => {
    // If the server is gone the banner says so; the place stays empty.
    import('../curves').then(setDrawing, () => undefined);
  }, []);
  const colours = palette.value;
  const { x, curves, mark, height, cursor, places } = props;

  useEffect(() => {
    const box = place.current;
    if (!box || !drawing) return undefined;
    const made = drawing.plotCurves(box, props, colours);
    plot.current = made;
    if (props.canvas) props.canvas.current = made.ctx.canvas;
    const observer = new ResizeObserver(() => {
      made.setSize({ width: Math.max(box.clientWidth, 100), height: props.height ?? HEIGHT });
    });
    observer.observe(box);
    return () => {
      observer.disconnect();
      made.destroy();
      plot.current = null;
      if (props.canvas) props.canvas.current = null;
    };
  }, [drawing, x, curves, mark?.at, mark?.half, height, colours, places]);

  useEffect(() => {
    const held = plot.current;
    if (!held || cursor === undefined) return;
    const left = cursor === null ? -10 : held.valToPos(x[cursor] ?? 0, 'x');
    // Without the hook, or both panes would answer each other.
    held.setCursor({ left, top: 10 }, false);
  }, [drawing, cursor, x]);

  return (
    <div
      ref={place}
      class="curve"
      role="img"
      aria-label={props.name}
      style={{ minHeight: `${height ?? HEIGHT}px` }}
    />
  );
}
