// A picture that stands by itself: title, what is to be known of it, the picture, its colour bar with unit.

import type { Code } from '../colours/codes';
import { positionOf, type Scale } from '../colours/range';
import type { Palette } from '../components/palette';
import { decades } from '../format/decades';
import { percent } from '../format/number';
import { roundAbove, ticks, tickText } from '../map/scale_bar';

/** The colours of a range; `low` and `high` in the unit that is written above. */
export interface Bar {
  table: Uint8Array;
  low: number;
  high: number;
  scale: Scale;
  unit: string;
}

/** What a picture is exported with. */
export interface Sheet {
  title: string;
  lines: string[];
  picture: HTMLCanvasElement;
  /** Pixels of `picture` per px of the page. */
  devicePixels: number;
  bar: Bar | null;
  codes: Code[] | null;
}

type Context = CanvasRenderingContext2D;

const EDGE = 12;
const TITLE = { font: '600 16px system-ui, sans-serif', height: 22 };
const WORDS = { font: '13px system-ui, sans-serif', height: 18 };
const BAR = { width: 100, colours: 18, top: 24, bottom: 10 };
const CODES_WIDTH = 170;

/** The words in lines that are no wider than `width`; a longer word has a line of its own. */
export function wrapped(text: string, width: number, measure: (text: string) => number): string[] {
  const lines: string[] = [];
  let line = '';
  for (const word of text.split(' ')) {
    const longer = line ? `${line} ${word}` : word;
    if (line && measure(longer) > width) {
      lines.push(line);
      line = word;
    } else line = longer;
  }
  return line ? [...lines, line] : lines;
}

/** Ticks of the bar, some 40 px apart. */
export function barTicks({ low, high, scale }: Bar, height: number): [value: number, text: string][] {
  if (scale === 'log' && low > 0) return decades(low, high).map((value) => [value, String(value)]);
  const spacing = ((high - low) * 40) / Math.max(height, 40);
  const step = roundAbove(spacing);
  return ticks(low, high, spacing).map((value) => [value, tickText(value, step)]);
}

function drawBar(context: Context, bar: Bar, height: number, palette: Palette): void {
  const length = Math.max(height - BAR.top - BAR.bottom, 1);
  context.fillStyle = palette.text;
  context.font = WORDS.font;
  context.textAlign = 'left';
  context.textBaseline = 'top';
  context.fillText(bar.unit, 0, 0);
  const entries = bar.table.length / 4;
  for (let entry = 0; entry < entries; entry += 1) {
    const [red, green, blue] = bar.table.subarray(entry * 4, entry * 4 + 3);
    context.fillStyle = `rgb(${red} ${green} ${blue})`;
    // A little higher than its share, so that no seam is left.
    const top = BAR.top + length * (1 - (entry + 1) / entries);
    context.fillRect(0, top, BAR.colours, Math.min(length / entries + 1, BAR.top + length - top));
  }
  context.fillStyle = palette.text;
  context.textBaseline = 'middle';
  for (const [value, text] of barTicks(bar, length)) {
    const y = BAR.top + length * (1 - positionOf(value, bar.low, bar.high, bar.scale));
    context.fillRect(BAR.colours, y, 4, 1);
    context.fillText(text, BAR.colours + 8, y);
  }
}

/** Strokes of the patterns that the map has for its classes. */
function drawPattern(context: Context, pattern: number, side: number): void {
  context.save();
  context.beginPath();
  context.rect(0, 0, side, side);
  context.clip();
  context.beginPath();
  for (let at = -side; at < 2 * side; at += 6) {
    if (pattern === 1 || pattern === 5) {
      context.moveTo(at + side, 0);
      context.lineTo(at, side);
    }
    if (pattern === 2 || pattern === 5) {
      context.moveTo(at, 0);
      context.lineTo(at + side, side);
    }
    if (pattern === 4) {
      context.moveTo(at + 1, 0);
      context.lineTo(at + 1, side);
    }
    if (pattern === 3) for (let y = 3; y < side; y += 6) context.rect(at + 2, y, 2, 2);
  }
  context.strokeStyle = '#000';
  context.lineWidth = 1.5;
  context.stroke();
  context.restore();
}

function drawCodes(context: Context, codes: Code[], palette: Palette): void {
  const side = 16;
  for (const { name, share, pattern, grey } of codes) {
    context.fillStyle = `rgb(${grey * 255} ${grey * 255} ${grey * 255})`;
    context.fillRect(0, 0, side, side);
    drawPattern(context, pattern, side);
    context.fillStyle = palette.text;
    context.font = WORDS.font;
    context.textAlign = 'left';
    context.textBaseline = 'middle';
    context.fillText(`${name} ${percent(share)}`, side + 6, side / 2);
    context.translate(0, side + 8);
  }
}

/** The picture with all that belongs to it. */
export function sheetOf(sheet: Sheet, palette: Palette): HTMLCanvasElement {
  const { picture, devicePixels } = sheet;
  const [width, height] = [picture.width / devicePixels, picture.height / devicePixels];
  const right = sheet.bar ? BAR.width : sheet.codes ? CODES_WIDTH : 0;
  const all = width + right + 2 * EDGE;
  const canvas = document.createElement('canvas');
  const context = canvas.getContext('2d')!;
  const inFont = (font: string, text: string): string[] => {
    context.font = font;
    return wrapped(text, all - 2 * EDGE, (part) => context.measureText(part).width);
  };
  const title = inFont(TITLE.font, sheet.title);
  const lines = sheet.lines.flatMap((line) => inFont(WORDS.font, line));
  const top = EDGE + title.length * TITLE.height + lines.length * WORDS.height + 6;
  canvas.width = Math.round(all * devicePixels);
  canvas.height = Math.round((top + height + EDGE) * devicePixels);
  context.scale(devicePixels, devicePixels);
  context.fillStyle = palette.ground;
  context.fillRect(0, 0, all, top + height + EDGE);
  context.textBaseline = 'top';
  context.textAlign = 'left';
  let y = EDGE;
  for (const [words, look, colour] of [
    [title, TITLE, palette.text],
    [lines, WORDS, palette.muted],
  ] as const) {
    context.font = look.font;
    context.fillStyle = colour;
    for (const line of words) {
      context.fillText(line, EDGE, y);
      y += look.height;
    }
  }
  context.drawImage(picture, EDGE, top, width, height);
  context.translate(EDGE + width + 12, top);
  if (sheet.bar) drawBar(context, sheet.bar, height, palette);
  else if (sheet.codes) drawCodes(context, sheet.codes, palette);
  return canvas;
}
