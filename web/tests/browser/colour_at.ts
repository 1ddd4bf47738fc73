import type { Page } from '@playwright/test';

/** A part of the screen, in px. */
export interface Part {
  x: number;
  y: number;
  width: number;
  height: number;
}

/** The colours of a part of the screen at one moment, row by row, each as red, green, blue. */
export async function coloursOf(page: Page, part: Part): Promise<number[][]> {
  const png = await page.screenshot({ clip: part });
  const bytes = await page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext('2d')!;
    context.drawImage(image, 0, 0);
    return [...context.getImageData(0, 0, image.width, image.height).data];
  }, png.toString('base64'));
  return Array.from({ length: bytes.length / 4 }, (_, at) => bytes.slice(4 * at, 4 * at + 3));
}

/** The colour of the screen at a point. */
export async function colourAt(page: Page, x: number, y: number): Promise<number[]> {
  const [colour] = await coloursOf(page, { x, y, width: 1, height: 1 });
  return colour!;
}

/** The different colours of a part of the screen, as sorted texts; only every `step`th pixel counts. */
export async function coloursIn(page: Page, part: Part, step = 1): Promise<string[]> {
  const colours = await coloursOf(page, part);
  return [...new Set(colours.filter((_, at) => at % step === 0).map(String))].sort();
}
