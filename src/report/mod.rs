//! Pictures: maps with axes and a scale, classes of pixels, charts, the figures of the paper, and figures of a calibration.

mod axis;
mod calibration;
mod canvas;
mod chart;
mod cost_image;
pub(crate) mod csv;
mod figures;
mod frame_picture;
mod heading;
pub mod html;
mod map_picture;

use epirig_core::fault::{Blame, Fault};
use thiserror::Error;

pub use calibration::calibration_figures;
pub use chart::{Chart, Marks, Series};
pub use figures::{Figure, FigureRow, paper_figures};
pub use map_picture::{
    MapPicture, Millimetres, ValueRange, Window, class_picture, height_colour, side_by_side,
};

/// A picture cannot be drawn.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("the picture \"{title}\" cannot be drawn: {reason}")]
pub struct ReportError {
    /// The picture's title.
    pub title: String,
    /// What went wrong.
    pub reason: String,
}

impl Fault for ReportError {
    fn blame(&self) -> Blame {
        Blame::System
    }
}

impl ReportError {
    fn new(title: &str, reason: impl ToString) -> Self {
        Self { title: title.to_owned(), reason: reason.to_string() }
    }
}
