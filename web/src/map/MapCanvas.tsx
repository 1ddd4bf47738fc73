import { useEffect, useRef, useState } from 'preact/hooks';
import { TakeButton } from '../components/TakeButton';
import { ZoomButtons } from '../components/ZoomButtons';
import { field } from './field';
import { MapController } from './controller';
import { tool } from '../store/selection';

/** The map with its marks. Both canvases belong to the controller, not to Preact. */
export function MapCanvas() {
  const gl = useRef<HTMLCanvasElement>(null);
  const marks = useRef<HTMLCanvasElement>(null);
  const [problem, setProblem] = useState<string | null>(null);
  useEffect(() => {
    if (!gl.current || !marks.current) return undefined;
    const controller = new MapController(gl.current, marks.current, setProblem);
    return () => controller.end();
  }, []);
  const name = field.value?.id === 'height' ? 'Height map' : (field.value?.title ?? 'Map');
  return (
    <div class="map" data-tool={tool.value}>
      <canvas ref={gl} class="map-values" />
      <canvas
        ref={marks}
        class="map-marks"
        id="map"
        role="img"
        tabIndex={0}
        aria-label={name}
        aria-describedby="map-help"
      />
      <span id="map-help" class="unseen">
        Arrow keys move the pin, plus and minus zoom, 0 shows all. The value at the pin is read out below.
      </span>
      <ZoomButtons />
      <TakeButton />
      {problem && (
        <p class="map-problem" role="alert">
          {problem}
        </p>
      )}
    </div>
  );
}
