// The questions that follow from the selection: what is at the pin, along the line, in the region.

import { computed, effect, signal, type ReadonlySignal } from '@preact/signals';
import {
  api,
  type Framed,
  type LineEnds,
  type LineInfo,
  type OneValue,
  type Pixel,
  type PixelInfo,
  type RegionInfo,
  type RegionQuery,
  type RowCost,
  type SurfaceQuestion,
  type SurfaceSummary,
} from '../api';
import type { Pin } from './hash';
import { field } from '../map/field';
import { latest, type Latest } from './latest';
import { isHeight, levelledBy } from './levelled';
import { mask } from './mask';
import { results } from './results';
import { drawing, hover, line, panel, pin, region, selection } from './selection';

export const pixel = latest<Pixel, Framed<PixelInfo>>(api.pixel);
export const profile = latest<LineEnds, LineInfo>(api.line, 150);
/** The profiles of the lines that stay. */
export const keptProfiles = latest<LineEnds[], LineInfo[]>(
  (all, abort) => Promise.all(all.map((ends) => api.line(ends, abort))),
  150,
);
/** A region of the heights in numbers. */
export const inRegion = latest<RegionQuery, RegionInfo>(api.region, 150);
export const rowCost = latest<number, Framed<RowCost>>((y, abort) => api.rowCost(y, abort), 150);

/** The pixel at 0 mm: as the server tells, or as follows from a pixel's place in mm; null if unknown. */
export const origin_px = computed<[x: number, y: number] | null>(() => {
  const geometry = results.value?.geometry;
  if (geometry?.origin_px) return geometry.origin_px;
  const head = pixel.state.value.value?.head;
  if (!geometry || !head || head.x_mm === null || head.y_mm === null) return null;
  return [head.x - head.x_mm / geometry.pixel_mm, head.y - head.y_mm / geometry.pixel_mm];
});

export const surface = latest<SurfaceQuestion, SurfaceSummary>(
  (asked, abort) => api.surface(asked, abort),
  200,
);

/** The form that is removed before steps and roughness are found. */
export const trend = signal('quadric');

const keptLines = computed(() => selection.value.kept);

/** The heights that are spoken of: those on the map, or those that count. */
const heightMap = computed(() => {
  const { map } = selection.value;
  return map && isHeight(map) ? map : 'height';
});

const look = (): Latest<string, OneValue> => latest(api.value, 60);

/** The value of what is shown at the pin, and under the pointer. */
export const atPin = look();
export const atPointer = look();

/** How the server is asked for a pixel of what is shown. */
export function pixelOf(shown: string, { x, y }: Pin): string {
  return `${shown}&x=${x}&y=${y}`;
}

// Texts, so that a new range, for example, asks nothing again.
const askedAt = (at: ReadonlySignal<Pin | null>): ReadonlySignal<string | null> =>
  computed(() => {
    const shown = field.value?.asked ?? null;
    return at.value && shown !== null ? pixelOf(shown, at.value) : null;
  });
const [pinAsked, pointerAsked] = [askedAt(pin), askedAt(hover)];

/** Asks when what is asked of has changed. While a line or a region is drawn, its every place would be a question. */
function askAtRest<T extends readonly unknown[]>(of: () => T, ask: (now: T) => void): void {
  let before: readonly unknown[] = [];
  effect(() => {
    const now = of();
    if (drawing.value || now.every((one, index) => index in before && one === before[index])) return;
    before = now;
    ask(now);
  });
}

export function followSelection(): void {
  effect(() => {
    const at = results.value?.results ? pin.value : null;
    pixel.ask(at && { ...at, levelled_by: levelledBy.value });
  });
  effect(() => {
    void results.value?.id;
    atPin.ask(pinAsked.value);
  });
  effect(() => atPointer.ask(pointerAsked.value));
  askAtRest(
    () => [results.value, line.value, levelledBy.value] as const,
    ([held, ends, levelled_by]) => profile.ask(held?.results && ends ? { ...ends, levelled_by } : null),
  );
  askAtRest(
    () => [results.value, keptLines.value, levelledBy.value] as const,
    ([held, kept, levelled_by]) => {
      keptProfiles.ask(
        held?.results && kept.length > 0 ? kept.map((ends) => ({ ...ends, levelled_by })) : null,
      );
    },
  );
  askAtRest(
    () => [results.value, region.value, heightMap.value, levelledBy.value] as const,
    ([held, part, map, levelled_by]) => {
      const [x0, y0, x1, y1] = part ?? [0, 0, 0, 0];
      inRegion.ask(part && held?.geometry ? { map, x0, y0, x1, y1, levelled_by } : null);
    },
  );
  askAtRest(
    () => [results.value, region.value, mask.value, trend.value] as const,
    ([held, part, inside, form]) => {
      const asked = { region: part, mask: inside, trend: form };
      surface.ask((part || inside) && held?.geometry ? asked : null);
    },
  );
  effect(() => rowCost.ask(panel.value === 'row-cost' && pin.value ? pin.value.y : null));
}
