import { useCallback } from 'preact/hooks';
import type { PixelInfo } from '../api';
import type { Palette } from '../components/palette';
import { along, drawAxes, edged, greyCanvas, prepare, type PictureAxis } from '../components/picture';
import { Picture } from '../components/Picture';
import { palette } from '../store/settings';

/** Rows are frames; few frames get more px each. */
function heightOf(frames: number): number {
  return Math.min(Math.max(frames * 2, 110), 180);
}

function draw(canvas: HTMLCanvasElement, head: PixelInfo, values: Float32Array, colours: Palette): void {
  const { context, frame } = prepare(canvas, heightOf(head.rows));
  const { left, top, width, height } = frame;
  context.imageSmoothingEnabled = false;
  const picture = greyCanvas(values, head.rows, head.columns, head.epi.low, head.epi.high);
  context.drawImage(picture, left, top, width, height);
  const x: PictureAxis = {
    first: head.epi.first_column,
    step: 1,
    count: head.columns,
    label: 'column (px)',
  };
  const y: PictureAxis = { first: 0, step: 1, count: head.rows, label: 'frame' };
  drawAxes(context, frame, x, y, colours);
  context.beginPath();
  context.rect(left, top, width, height);
  context.clip();
  const trace = (column: number, disparity: number): void => {
    context.beginPath();
    head.tau.forEach((tau, index) => {
      context.lineTo(left + along(x, column + disparity * tau) * width, top + along(y, index) * height);
    });
  };
  for (const neighbour of head.neighbours) {
    if (neighbour.agrees) continue;
    trace(neighbour.column, neighbour.disparity_px);
    // Neighbours of other rows are fainter: they do not lie in this plane.
    edged(context, neighbour.row === head.y ? [5, 4] : [2, 4], 1.2, '#ffd27f');
  }
  if (!head.line) return;
  const { column, disparity_px, sigma_px } = head.line;
  for (const disparity of [disparity_px - sigma_px, disparity_px + sigma_px]) {
    trace(column, disparity);
    edged(context, [], 0.7, '#fff');
  }
  trace(column, disparity_px);
  edged(context, [], 1.6, '#fff');
}

/** The epipolar plane image around the pin, with the line that the matcher fitted. */
export function EpiPanel({ head, values }: { head: PixelInfo; values: Float32Array }) {
  const colours = palette.value;
  const drawn = useCallback(
    (canvas: HTMLCanvasElement) => draw(canvas, head, values, colours),
    [head, values, colours],
  );
  const others = head.neighbours.filter((one) => !one.agrees).length;
  return (
    <section>
      <h3>
        EPI, row {head.y}
        <span class="muted">
          {head.line ? ', fitted line ± sigma' : ', no fitted line'}
          {others > 0 && `; dashed: ${others} neighbours that disagree`}
        </span>
      </h3>
      <Picture name={`Epipolar plane image of row ${head.y}`} height={heightOf(head.rows)} draw={drawn} />
    </section>
  );
}
