// Numbers as people read them: sigma with two significant digits, the value to the same decimal place, a real
// minus sign. GUM 7.2.6 gives the rule.

const MINUS = '\u2212';
const THIN = '\u2009';

/** Replaces the hyphen of a number by a minus sign. */
export function withMinus(text: string): string {
  return text.replace(/-/g, MINUS);
}

/** Decimal places of a sigma that is given with two significant digits; 0.0996 becomes 0.10, thus 2. */
export function placesOfSigma(sigma: number): number {
  const exponent = Number(sigma.toExponential(1).split('e')[1]);
  return Math.min(Math.max(1 - exponent, 0), 12);
}

/** With so many decimal places. */
export function toPlaces(value: number, places: number): string {
  const text = value.toFixed(places);
  // No minus before zero.
  return withMinus(/^-0(\.0*)?$/.test(text) ? text.slice(1) : text);
}

/** Integers of sigma beyond two digits are rounded to tens, hundreds and so on, as the value is. */
function toTens(value: number, sigma: number): string {
  const exponent = Number(sigma.toExponential(1).split('e')[1]);
  const unit = 10 ** Math.max(exponent - 1, 0);
  return toPlaces(Math.round(value / unit) * unit, 0);
}

/** The value and its sigma as two texts; sigma is null if it is unknown. */
export function valueAndSigma(
  value: number,
  sigma: number | null,
): { value: string; sigma: string | null } {
  if (sigma === null || !Number.isFinite(sigma) || sigma <= 0) {
    return { value: significant(value, 3), sigma: null };
  }
  if (sigma >= 99.5) return { value: toTens(value, sigma), sigma: toTens(sigma, sigma) };
  const places = placesOfSigma(sigma);
  return { value: toPlaces(value, places), sigma: toPlaces(sigma, places) };
}

/** `0.2003 mm, sigma 0.0012`, or `0.200 mm, sigma unknown`. */
export function measured(value: number, sigma: number | null, unit: string): string {
  const texts = valueAndSigma(value, sigma);
  return `${texts.value}${unit ? ` ${unit}` : ''}, sigma ${texts.sigma ?? 'unknown'}`;
}

/** `0.2003 ± 0.0012 mm` of an interval with 95 % coverage, for which alone the sign stands. */
export function interval(value: number, half_width: number | null, unit: string): string {
  const texts = valueAndSigma(value, half_width);
  const after = unit ? ` ${unit}` : '';
  return texts.sigma === null ? `${texts.value}${after}` : `${texts.value} ± ${texts.sigma}${after}`;
}

const SPOKEN: Record<string, string> = { mm: 'millimetres', µm: 'micrometres', px: 'pixels', DN: 'counts' };

/** The same for a screen reader. */
export function spoken(value: number, sigma: number | null, unit: string): string {
  const texts = valueAndSigma(value, sigma);
  const plain = (text: string): string => text.replace(MINUS, 'minus ');
  const after = unit ? ` ${SPOKEN[unit] ?? unit}` : '';
  return `${plain(texts.value)}${after}, sigma ${texts.sigma === null ? 'unknown' : plain(texts.sigma)}`;
}

/** A number with so many significant digits, without an exponent where people can still read it. */
export function significant(value: number, digits: number): string {
  if (value === 0) return '0';
  if (!Number.isFinite(value)) return 'none';
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e7) {
    const [mantissa = '', exponent = ''] = value.toExponential(digits - 1).split('e');
    return withMinus(`${mantissa}e${exponent.replace('+', '')}`);
  }
  const exponent = Number(value.toExponential(digits - 1).split('e')[1]);
  return toPlaces(value, Math.max(digits - 1 - exponent, 0));
}

/** A number without a known sigma: a whole one as it is, else with four digits. */
export function plainly(value: number): string {
  return Number.isInteger(value) ? withMinus(String(value)) : significant(value, 4);
}

/** A share between 0 and 1 as per cent with two digits. */
export function percent(share: number): string {
  const value = share * 100;
  if (value === 0) return '0 %';
  if (value === 100) return '100 %';
  if (value >= 99.5) return `${Math.min(Number(value.toFixed(1)), 99.9)} %`;
  if (value < 0.1) return '< 0.1 %';
  return `${significant(value, 2)} %`;
}

/** A whole number in groups of three. */
export function count(value: number): string {
  return withMinus(Math.round(value).toString()).replace(/\B(?=(\d{3})+$)/g, THIN);
}

/** Bytes in kB, MB, GB. */
export function bytes(value: number): string {
  for (const [unit, size] of [
    ['GB', 1e9],
    ['MB', 1e6],
    ['kB', 1e3],
  ] as const) {
    if (value >= size) return `${significant(value / size, 3)} ${unit}`;
  }
  return `${value} bytes`;
}

/** Text of a number that a person edits: to a thousandth of `span` if that is given. */
export function editable(value: number, span?: number): string {
  const places = span && span > 0 ? Math.max(0, Math.ceil(-Math.log10(span / 1000))) : 6;
  return withMinus(String(Number(value.toFixed(Math.min(places, 12)))));
}

/** Reads what a person typed; decimal comma and real minus are accepted. */
export function readNumber(text: string): number | null {
  const plain = text.trim().replace(MINUS, '-').replace(',', '.');
  if (plain === '') return null;
  const value = Number(plain);
  return Number.isFinite(value) ? value : null;
}
