// Pictures of what is on the screen, to take away.

import { colourTable } from '../colours/tables';
import { field, shownColours, shownRange, type Field } from '../map/field';
import { pictureOf, type Picture } from '../map/handle';
import { save } from '../store/actions';
import { refuse } from '../store/notices';
import { results, unitOf } from '../store/results';
import { palette } from '../store/settings';
import { sheetOf, type Bar, type Sheet } from './sheet';

/** The colours of a map or frame, with the range that is shown. */
function barOf(shown: Field): Bar | null {
  if (shown.codes) return null;
  const { low, high } = shownRange.value;
  const { label, factor } = unitOf(shown.unit);
  const table = colourTable(shownColours.value);
  return { table, low: low * factor, high: high * factor, scale: shown.scale, unit: label };
}

/** Which sequence, which results. */
function source(): string {
  const held = results.value;
  const of = held?.results;
  return [held && `sequence ${held.sequence.name}`, of && `results ${of.name}, ${of.program}`]
    .filter(Boolean)
    .join('; ');
}

async function take(sheet: Sheet, name: string): Promise<void> {
  try {
    const canvas = sheetOf(sheet, palette.value);
    const blob = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, 'image/png'));
    if (!blob) throw new Error('The browser made no PNG of this picture; make the window smaller.');
    save(blob, name);
  } catch (fault) {
    refuse(fault);
  }
}

function named(what: string): string {
  return `${[results.value?.sequence.name, what].filter(Boolean).join('-')}.png`;
}

/** The map, or the surface in 3-D, as it is on the screen. */
export async function takeView(): Promise<void> {
  const shown = field.value;
  const made = pictureOf.value?.();
  if (!shown || !made) return;
  const { picture, devicePixels, words, coloured, solid } = made;
  const sheet: Sheet = {
    title: solid ? `${shown.title}, in 3-D` : shown.title,
    lines: [...words, source()],
    picture,
    devicePixels,
    bar: coloured ? barOf(shown) : null,
    codes: shown.codes,
  };
  await take(sheet, named(solid ? `${shown.id}-3d` : shown.id));
}

/** Curves that are on the screen; `titled` says what they are. */
export async function takeCurves(
  { picture, devicePixels }: Pick<Picture, 'picture' | 'devicePixels'>,
  title: string,
  words: string[],
  what: string,
): Promise<void> {
  await take(
    { title, lines: [...words, source()], picture, devicePixels, bar: null, codes: null },
    named(what),
  );
}
