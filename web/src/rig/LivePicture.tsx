import { useEffect, useRef } from 'preact/hooks';
import { ZoomButtons } from '../components/ZoomButtons';
import { percent } from '../format/number';
import { PictureController } from './picture_controller';
import { age_ms, head, overlays, stale } from './picture_store';
import { rigState } from './store';
import { looking, toggleTarget } from './targeting';
import { ageText, shareText } from './texts';
import { OrderButton } from './OrderButton';
import { whyNoCamera } from './why';

const TOGGLES: [name: keyof typeof overlays, words: string, key: string, means: string][] = [
  ['zebra', 'saturated', 'Z', 'Stripes: saturated. Dots: dark, at 0 DN.'],
  ['grid', 'grid', 'G', 'Sixths of the frame'],
  ['peaking', 'peaking', 'F', 'Edges that are sharp are coloured'],
  ['vignetting', 'vignetting', 'V', 'Light of the corners against that of the centre'],
];

function Toggles() {
  return (
    <div class="toolbar" role="toolbar" aria-label="Overlays">
      {TOGGLES.map(([name, words, key, means]) => (
        <button
          key={name}
          type="button"
          aria-pressed={overlays[name].value}
          aria-keyshortcuts={key}
          title={means}
          onClick={() => (overlays[name].value = !overlays[name].peek())}
        >
          {words} <kbd>{key}</kbd>
        </button>
      ))}
      <OrderButton act={toggleTarget} why={whyNoCamera.value} pressed={looking.value}>
        target <kbd>T</kbd>
      </OrderButton>
      <ZoomButtons />
    </div>
  );
}

/** Light of the corners against that of the centre, as nine parts. */
function Vignetting() {
  const corners = rigState.value?.light?.corners ?? null;
  if (!overlays.vignetting.value) return null;
  return (
    <div class="vignetting" role="img" aria-label={`Corners: ${cornersText(corners)}`}>
      {Array.from({ length: 9 }, (_, part) => {
        const corner = part % 2 === 0 && part !== 4;
        return (
          <span key={part} class={corner ? 'corner' : ''}>
            {part === 4 ? '100 %' : corner && corners !== null ? percent(corners) : ''}
          </span>
        );
      })}
    </div>
  );
}

/** `31 % darker`: than the centre. */
export function cornersText(corners: number | null): string {
  if (corners === null) return 'seen on an even target only';
  const share = Math.abs(1 - corners);
  return `${percent(share)} ${corners <= 1 ? 'darker' : 'brighter'}`;
}

/** Why there is no fresh picture; null if there is one. */
function veilWords(): string | null {
  const camera = rigState.value?.camera;
  const old = age_ms.value;
  if (camera?.state === 'lost') {
    return old === null || old < 1000 ? 'camera lost' : `camera lost; last picture ${ageText(old)} ago`;
  }
  if (head.value === null) {
    return camera?.state === 'live' ? 'waiting for the first picture' : 'connecting to the camera';
  }
  return stale.value && old !== null ? `${ageText(old)} old` : null;
}

/** What the picture shows, for those who do not see it. */
function Description() {
  const light = rigState.value?.light;
  if (!light) return <>no values yet</>;
  return (
    <>
      saturated {shareText(light.saturated, light.pixels)}, dark {shareText(light.black, light.pixels)},
      corners {cornersText(light.corners)}
    </>
  );
}

/** The live picture with its overlays. The canvas belongs to the controller, not to Preact. */
export function LivePicture() {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    if (!canvas.current) return undefined;
    const controller = new PictureController(canvas.current);
    return () => controller.end();
  }, []);
  const veil = veilWords();
  return (
    <div class="rig-picture">
      <Toggles />
      <div class="live">
        <canvas
          ref={canvas}
          id="map"
          role="img"
          tabIndex={0}
          aria-label="Live picture"
          aria-describedby="live-help"
        />
        <span id="live-help" class="unseen">
          Plus and minus zoom, 0 shows all, arrow keys move. <Description />
        </span>
        <Vignetting />
        {veil !== null && (
          <p class="veil" role="status" aria-label="Picture">
            {veil}
          </p>
        )}
      </div>
    </div>
  );
}
