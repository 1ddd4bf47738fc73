// Moments as people read them. A record has nine decimals of the second.

/** `2026-11-24 10:29`, for lists. */
export function minute(stamp: string): string {
  return moment(stamp).slice(0, 16);
}

/** `2026-11-24 10:29:43Z` of `2026-11-24T10:29:43.212462583Z`. */
export function moment(stamp: string): string {
  return stamp.replace('T', ' ').replace(/\.\d+/, '');
}
