//! How squares of the small pictures are compared, and what a motion is that they show.

/// Side of the squares that are looked for, in px of the small pictures.
pub(super) const SIDE: usize = 12;
/// Squares of a picture that are looked for in others, at most.
pub(super) const POINTS: usize = 120;
/// Fewest points that speak for a motion.
pub(super) const FEWEST: usize = 4;
/// Squares correlate at least so well, or they do not show the same thing. Views of one texture correlate by
/// S / (S + N) with variances S of the texture and N of the noise, so N may be half of S. Squares of 144 independent
/// pixels that have nothing in common correlate by less than 0.25, three times 1 / 12.
pub(super) const LEAST_CORRELATION: f32 = 0.65;
/// Another place that correlates as well, less this, leaves it open which is true. A correlation c of n pixels has a
/// standard deviation of (1 - c^2) / sqrt(n), which is 0.03 for 0.8 and 144 pixels: this is twice that.
pub(super) const AMBIGUOUS: f32 = 0.06;
/// Places nearer than this are one, in px.
pub(super) const ONE_PLACE_PX: f64 = 2.5;
/// Points move if they go at least so far, and a motion is clear from this size on, in px.
pub(super) const MOVES_PX: f64 = 0.5;
pub(super) const CLEAR_PX: f64 = 1.5;

/// Where a parabola through three values has its peak, from the middle one.
pub(super) fn peak(before: f32, here: f32, after: f32) -> f64 {
    let (before, after) = (f64::from(here - before), f64::from(here - after));
    if before + after > 0.0 { (0.5 * (before - after) / (before + after)).clamp(-0.5, 0.5) } else { 0.0 }
}
