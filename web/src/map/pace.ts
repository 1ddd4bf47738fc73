// A computer without a graphics chip cannot draw a large map at every picture of the screen. While a handle
// moves it then draws fewer pixels: a smooth motion says more than fine detail.

/** At 60 Hz pictures are 17 ms apart, and 33 ms where one was missed: this lies between. */
const SMOOTH_MS = 25;
/** After a longer time nothing was moving, which tells nothing of the computer. */
const PAUSE_MS = 250;
/** Pictures in a row that must be late. */
const LATE = 3;
/** Pixels along each side, while the computer is too slow: a ninth of all pixels. */
const SHARE = 1 / 3;

export class Pace {
  private last = -Infinity;
  private late = 0;

  /** How many of the pixels along each side to draw in the picture that begins now. */
  share(moving: boolean, now: number): number {
    const since = now - this.last;
    this.last = now;
    if (!moving) this.late = 0;
    else if (this.late < LATE && since < PAUSE_MS) this.late = since > SMOOTH_MS ? this.late + 1 : 0;
    return this.late < LATE ? 1 : SHARE;
  }
}
