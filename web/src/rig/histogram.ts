// A histogram as the outline of its bars.

/** Counts added up until there are at most `most` bars. */
export function coarser(counts: readonly number[], most: number): number[] {
  const together = Math.max(1, Math.ceil(counts.length / most));
  if (together === 1) return [...counts];
  const sums = new Array<number>(Math.ceil(counts.length / together)).fill(0);
  counts.forEach((count, index) => (sums[Math.floor(index / together)]! += count));
  return sums;
}

/**
 * The outline as an SVG path on a plane of `width` by `height`; `bins` is how many bins the full scale has.
 * Empty bars have no height, also with logarithms: one count is already seen.
 */
export function histogramPath(
  counts: readonly number[],
  bins: number,
  width: number,
  height: number,
  logarithmic: boolean,
): string {
  const all = [...counts, ...new Array<number>(Math.max(0, bins - counts.length)).fill(0)];
  const bars = coarser(all, width).map((count) => (logarithmic ? Math.log1p(count) : count));
  const highest = Math.max(...bars, 1e-9);
  const step = width / bars.length;
  const outline = bars.map((bar, index) => {
    const y = (height - (bar / highest) * height).toFixed(1);
    return `V${y}H${((index + 1) * step).toFixed(2)}`;
  });
  return `M0 ${height}${outline.join('')}V${height}Z`;
}
