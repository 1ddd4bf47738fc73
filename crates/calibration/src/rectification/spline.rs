//! The kernel of the resampling: the quintic B-spline through all pixels (Unser 1999).
//!
//! Shift of a wave by the resampling, worst of windows of 9 px, and time for a sample beside that of a plain
//! bilinear remap:
//!
//! | | 6.3 px | 4.2 px | 3.1 px | time |
//! | --- | --- | --- | --- | --- |
//! | cubic | 0.0011 px | 0.0062 px | 0.0235 px | 0.6 |
//! | quintic | 0.0001 px | 0.0007 px | 0.0056 px | 0.9 |
//!
//! Measured with roll 0.7 deg, pan 0.4 deg and k1 = -0.02, which take every fraction of a pixel in turn.

use epirig_core::spline::quintic::{TAPS, TAPS_BEFORE, recursion_gain};

/// Number of pixels after which the start of the filter has no effect: 0.4306^17 = 6e-7, a fiftieth of a
/// count of a fine volume at full scale.
pub(super) const HORIZON: usize = 17;

/// Mirrored pixels around a row: for the filter to settle, and for the taps of samples at the border.
pub(super) const PAD: usize = HORIZON + TAPS;
/// Coefficients before the pixel of a sample.
pub(super) const BEFORE: usize = TAPS_BEFORE;

/// Distance from the borders of all frames at which a pixel of a covering mapping counts as seen, in px: a ramp is wrong
/// by 0.014 of its rise per pixel there, and by 0.43 times that a pixel farther in (see [`BORDER_PX`]). Moving contents
/// pass the borders anyway, and a match follows them to within some pixels.
pub(super) const SEEN_PX: f64 = 3.0;

/// Distance of rectified pixels from the border of the raw image, in px.
///
/// The filter mirrors the image at its borders, which turns a ramp into a kink there. At this distance the
/// spline is wrong by 0.0002 of the ramp's rise per pixel, that is by 0.0002 px, and a pixel farther in by
/// 0.43 times that.
pub const BORDER_PX: f64 = 8.0;

/// The answer of the filter to a constant 1, along both axes: the filter leaves out the factor (1 - pole)^2
/// of each pole.
pub(super) fn filter_gain() -> f32 {
    let along_one_axis = recursion_gain();
    (along_one_axis * along_one_axis) as f32
}

/// The pixel at `place` of an image that is mirrored at the centres of its first and last pixel.
pub(super) fn mirrored(place: isize, size: usize) -> usize {
    let last = size as isize - 1;
    let around = place.rem_euclid((2 * last).max(1));
    around.min(2 * last - around).max(0) as usize
}
