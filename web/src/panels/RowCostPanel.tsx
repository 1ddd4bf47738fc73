import { useCallback, useMemo } from 'preact/hooks';
import type { Framed, RowCost } from '../api';
import type { Palette } from '../components/palette';
import { along, drawAxes, greyCanvas, prepare, type PictureAxis } from '../components/picture';
import { Picture } from '../components/Picture';
import { rowCost } from '../store/questions';
import { pin, select } from '../store/selection';
import { palette } from '../store/settings';

const HEIGHT = 240;

interface Grey {
  values: Float32Array;
  low: number;
  high: number;
}

/** Bright where the cost is low, as in figure 3b of the paper. */
function greyOf(values: Float32Array): Grey {
  const grey = values.map((cost) => -Math.log10(cost + 1e-3));
  const known = grey.filter(Number.isFinite).sort();
  const at = (share: number): number => known[Math.floor(share * (known.length - 1))] ?? 0;
  return { values: grey, low: at(0.02), high: at(0.998) };
}

function axesOf(head: RowCost): { x: PictureAxis; y: PictureAxis } {
  return {
    x: { first: 0, step: 1, count: head.columns, label: 'column (px)' },
    y: { first: head.first_px, step: head.step_px, count: head.rows, label: 'disparity (px)' },
  };
}

function draw(
  canvas: HTMLCanvasElement,
  head: RowCost,
  grey: Grey,
  column: number,
  colours: Palette,
): void {
  const { context, frame } = prepare(canvas, HEIGHT);
  const { left, top, width, height } = frame;
  const picture = greyCanvas(grey.values, head.rows, head.columns, grey.low, grey.high);
  context.drawImage(picture, left, top, width, height);
  const { x, y } = axesOf(head);
  drawAxes(context, frame, x, y, colours);
  context.fillStyle = '#e69f00';
  head.mapping.forEach((disparity, at) => {
    if (disparity === null) return;
    context.fillRect(
      left + along(x, at) * width - 0.75,
      top + along(y, disparity) * height - 0.75,
      1.5,
      1.5,
    );
  });
  const at = left + along(x, column) * width;
  context.fillStyle = 'rgb(0 0 0 / 0.6)';
  context.fillRect(at - 1.5, top, 3, height);
  context.fillStyle = '#fff';
  context.fillRect(at - 0.5, top, 1, height);
}

function RowCostPicture({ reply, column }: { reply: Framed<RowCost>; column: number }) {
  const { head, values } = reply;
  const colours = palette.value;
  const grey = useMemo(() => greyOf(values), [values]);
  const drawn = useCallback(
    (canvas: HTMLCanvasElement) => draw(canvas, head, grey, column, colours),
    [head, grey, column, colours],
  );
  const pick = (x: number): void => {
    const width = document.querySelector('.row-cost canvas')?.clientWidth ?? 1;
    const at = Math.floor((x / Math.max(width - 50, 1)) * head.columns);
    if (at >= 0 && at < head.columns) select({ pin: { x: at, y: head.y } });
  };
  return (
    <Picture
      name={`Cost of row ${head.y} against column and disparity`}
      height={HEIGHT}
      draw={drawn}
      onPick={pick}
    />
  );
}

/** The cost of every disparity candidate of a row, with the disparities that were chosen. */
export function RowCostPanel() {
  const { value, error, loading } = rowCost.state.value;
  const at = pin.value;
  if (!at) return <p class="hint">Set the pin: the costs of its row are shown here.</p>;
  return (
    <div class={loading ? 'loading' : ''}>
      <h2>Cost of row {value?.head.y ?? at.y}</h2>
      <p class="muted note">
        Bright: low cost. Where there is no texture, as on plain ground, every disparity fits: all of the
        column is bright. Orange: the disparity that was chosen. White line: the pin; a click moves it.
      </p>
      {error && <p class="fault">{error}</p>}
      {loading && !value && <p class="hint">computing…</p>}
      {value && <RowCostPicture reply={value} column={at.x} />}
    </div>
  );
}
