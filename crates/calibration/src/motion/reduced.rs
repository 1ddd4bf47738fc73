//! Frames made small: a hundred of them are held at once.

use epirig_core::frame::Frame;
use epirig_core::grid::Grid;
use epirig_core::image::{reduced, reduced_frame};

/// A small frame, and one of half its size: means over squares of pixels.
#[derive(Debug, Clone)]
pub(super) struct Reduced {
    /// Pixels of the frame for one of this, in either direction.
    pub(super) factor: usize,
    pub(super) fine: Grid<f32>,
    pub(super) coarse: Grid<f32>,
}

impl Reduced {
    /// A frame reduced until its longer side has `longest` pixels at most.
    pub(super) fn of(frame: &Frame, longest: usize) -> Self {
        let factor = frame.rows().max(frame.columns()).div_ceil(longest).max(1);
        let fine = reduced_frame(frame, factor);
        let coarse = reduced(&fine, 2);
        Self { factor, fine, coarse }
    }
}
