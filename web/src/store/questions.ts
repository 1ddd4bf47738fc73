// The questions that follow from the selection: what is at the pin, along the line, in the region.

import { computed, effect, signal } from '@preact/signals';
import {
  api,
  type Framed,
  type LineInfo,
  type PixelInfo,
  type RowCost,
  type SurfaceQuestion,
  type SurfaceSummary,
} from '../api';
import type { LineSelection, Pin } from './hash';
import { latest } from './latest';
import { mask } from './mask';
import { results } from './results';
import { line, panel, pin, region } from './selection';

export const pixel = latest<Pin, Framed<PixelInfo>>(({ x, y }, abort) => api.pixel(x, y, abort));
export const profile = latest<LineSelection, LineInfo>((ends, abort) => api.line({ ...ends }, abort), 150);
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

export function followSelection(): void {
  effect(() => pixel.ask(results.value?.results ? pin.value : null));
  effect(() => profile.ask(results.value?.results ? line.value : null));
  effect(() => {
    const asked = { region: region.value, mask: mask.value, trend: trend.value };
    surface.ask((asked.region || asked.mask) && results.value?.geometry ? asked : null);
  });
  effect(() => rowCost.ask(panel.value === 'row-cost' && pin.value ? pin.value.y : null));
}
