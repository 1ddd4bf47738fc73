//! Intensities along one line of an EPI.

use super::cost::interpolation::{Interpolation, SampledEpi};
use super::lines::EpiLines;
use epirig_core::volume::Volume;

/// Intensity in DN of each frame along the line through column `x` (which may lie between pixels) of the
/// reference frame of `lines`, for row `y` and disparity `disparity_px`; NaN where the line leaves the image.
///
/// # Panics
/// If `y` lies outside the volume.
pub fn line_profile(volume: &Volume, lines: &EpiLines, x: f64, y: usize, disparity_px: f64) -> Vec<f32> {
    let epi = SampledEpi::new(volume, y, Interpolation::BSpline, 0);
    let value = |(t, &tau): (usize, &f64)| epi.at(t, x + disparity_px * tau).unwrap_or(f32::NAN);
    lines.offsets().iter().enumerate().map(value).collect()
}
