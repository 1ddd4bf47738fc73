import { useEffect, useRef } from 'preact/hooks';
import { MARGIN } from './picture';

interface Props {
  /** What it shows, for those who do not see it. */
  name: string;
  /** Height of the picture without its axes, in px of the page. */
  height: number;
  draw: (canvas: HTMLCanvasElement) => void;
  /** Where it was clicked, from 0 to 1 along each side. */
  onPick?: (x: number, y: number) => void;
}

/** A canvas that is drawn anew when its width or its drawing changes. */
export function Picture({ name, height, draw, onPick }: Props) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const here = canvas.current;
    if (!here) return undefined;
    const observer = new ResizeObserver(() => draw(here));
    observer.observe(here);
    return () => observer.disconnect();
  }, [draw]);
  return (
    <canvas
      ref={canvas}
      class="picture"
      role="img"
      aria-label={name}
      style={{ height: `${height + MARGIN.top + MARGIN.bottom}px` }}
      onClick={(event) => {
        const width = event.currentTarget.clientWidth - MARGIN.left - MARGIN.right;
        onPick?.((event.offsetX - MARGIN.left) / width, (event.offsetY - MARGIN.top) / height);
      }}
    />
  );
}
