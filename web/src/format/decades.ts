// Ticks of a logarithmic axis.

/** The values 1, 2 and 5 of each decade between two ends. */
export function decades(low: number, high: number): number[] {
  const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
  const all: number[] = [];
  for (let exponent = first; exponent <= last; exponent += 1) {
    for (const digit of [1, 2, 5]) all.push(Number(`${digit}e${exponent}`));
  }
  return all.filter((value) => value >= low && value <= high);
}
