// Where words go beside what they are about.

interface Box {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

const GAP = 6;

function meet(one: Box, other: Box): boolean {
  return (
    one.left < other.right && one.right > other.left && one.top < other.bottom && one.bottom > other.top
  );
}

/** Where words of this size go beside `at`: below it or above it, and never over STOP; null if nowhere. */
export function placeBeside(
  at: Box,
  size: { width: number; height: number },
  screen: { width: number; height: number },
  kept: Box[],
): { left: number; top: number } | null {
  const left = Math.max(GAP, Math.min(at.left, screen.width - size.width - GAP));
  for (const top of [at.bottom + GAP, at.top - GAP - size.height]) {
    const box = { left, top, right: left + size.width, bottom: top + size.height };
    const inside = top >= 0 && box.bottom <= screen.height;
    if (inside && !kept.some((other) => meet(box, other))) return { left, top };
  }
  return null;
}
