//! What can be wrong with a target.

use epirig_core::fault::{Blame, Fault};
use thiserror::Error;

/// Why a target cannot be printed, or its corners cannot be labelled.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TargetError {
    /// A board or its bands are not possible.
    #[error(
        "this is no target: {reason}; give at least 2 columns and 2 rows of inner corners and lengths above 0 mm"
    )]
    Description {
        /// What is wrong.
        reason: String,
    },
    /// The sheet does not hold the target.
    #[error(
        "the target is {width_mm:.1} mm x {height_mm:.1} mm with its margins and does not fit the page {page} ({page_width_mm:.1} mm x \
         {page_height_mm:.1} mm); choose a larger page, `fit`, fewer or smaller squares"
    )]
    Page {
        /// Name of the page.
        page: String,
        /// Width that is needed, in mm.
        width_mm: f64,
        /// Height that is needed, in mm.
        height_mm: f64,
        /// Width of the page, in mm.
        page_width_mm: f64,
        /// Height of the page, in mm.
        page_height_mm: f64,
    },
    /// Positions that are not one for each frame, or are not numbers.
    #[error(
        "{positions} stage positions for {frames} frames; give one finite position for each frame, or none at all"
    )]
    Positions {
        /// Positions given.
        positions: usize,
        /// Frames given.
        frames: usize,
    },
    /// No board in any frame.
    #[error(
        "no frame shows a chess-board of {columns} x {rows} inner corners; check the count (inner corners, not squares), light and focus"
    )]
    NoBoard {
        /// Columns looked for.
        columns: usize,
        /// Rows looked for.
        rows: usize,
    },
    /// One band is never seen, or cannot be distinguished from the other.
    #[error(
        "the two bands of the target cannot be distinguished: {reason}; put both bands into view in some frames, or describe the target as one band"
    )]
    Bands {
        /// The findings.
        reason: String,
    },
    /// More than one labelling fits.
    #[error(
        "frames {first} and {second} show parts of the board that can be labelled in more than one way (moved by {one:.2} or by {other:.2} squares); take \
         smaller steps, give the stage positions, or let at least two frames show the whole board"
    )]
    Ambiguous {
        /// First frame with this band, from 0.
        first: usize,
        /// Last frame with this band, from 0.
        second: usize,
        /// Movement by the one labelling, in squares.
        one: f64,
        /// Movement by the other.
        other: f64,
    },
    /// No straight uniform motion fits.
    #[error(
        "only {fitting} of {boards} views of band {band} fit a board that moves straight and evenly with the stage; check the order of the frames and \
         their positions, and that the board did not slip"
    )]
    Motion {
        /// The band, from 0.
        band: usize,
        /// Views that fit.
        fitting: usize,
        /// Number of views.
        boards: usize,
    },
}

impl Fault for TargetError {
    fn blame(&self) -> Blame {
        Blame::Request
    }
}
