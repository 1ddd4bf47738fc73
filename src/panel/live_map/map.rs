//! A live map.

use epirig_core::grid::Grid;

/// What the frames so far tell.
///
/// The frames are used as the camera gave them. A lens that distorts, or a camera that is rolled against the
/// stage, makes errors that no sigma here contains; they go away with a calibration, after the scan.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveMap {
    /// Number of frames that the map is made of.
    pub frames: usize,
    /// Number of frames that the scan is to have.
    pub planned: usize,
    /// Side of the square of pixels of the first frame that a value belongs to, in px. Value (X, Y) belongs
    /// to the pixels from (bin X, bin Y) on; the last columns and rows have no value if they fill no square.
    pub bin: usize,
    /// Disparity over the whole planned baseline, signed, in px of the whole frame; NaN where there is no
    /// answer.
    pub disparity: Grid<f32>,
    /// Standard deviation of the disparity, in px of the whole frame; NaN where there is no answer.
    pub sigma: Grid<f32>,
    /// Median sigma of the pixels with an answer, in px of the whole frame.
    pub median_sigma_px: f64,
}
