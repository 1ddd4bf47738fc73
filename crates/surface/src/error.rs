//! Why a surface cannot be evaluated.

use epirig_core::fault::{Blame, Fault};
use thiserror::Error;

/// Why a question to a surface has no answer.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// Too few pixels for the fit.
    #[error(
        "only {pixels} pixels have a height, too few for {what}; look at mask.png for what the matcher could not answer"
    )]
    TooFewPixels {
        /// Pixels with height and sigma.
        pixels: usize,
        /// The model to be fitted.
        what: &'static str,
    },
    /// No part of the heights is wide enough.
    #[error(
        "no connected region of heights holds a square of {side_px} px, which is needed to distinguish two levels; look at mask.png for what the \
         matcher could not answer, or choose another region"
    )]
    NoExtent {
        /// Side of the square that was looked for, in px.
        side_px: usize,
    },
    /// The pixels lie so that the trend is open, such as all in one row.
    #[error("the pixels that have a height do not determine {what}; choose a simpler trend")]
    Undetermined {
        /// What was to be fitted.
        what: &'static str,
    },
    /// The field shows one level, or two that noise does not tell apart.
    #[error(
        "the heights show no two levels: the best division finds a step of {depth_mm:.4} mm where heights scatter by {scatter_mm:.4} mm \
         about their level; if that is form, another form of the trend may describe it; if it is noise, take more frames or a longer baseline"
    )]
    OneLevel {
        /// Step of the best division, in mm.
        depth_mm: f64,
        /// Standard deviation of the smoothed heights about their level, in mm.
        scatter_mm: f64,
    },
    /// Heights lie between the two levels of the best division as often as on them.
    #[error(
        "the heights show no two levels: the best division has a step of {depth_mm:.4} mm, but as many heights lie between as on the \
         levels; the surface is wavy, noise or changing light hides the levels (take more frames, correct the light), or hollows are too \
         narrow for the windows of the match (bring the camera nearer)"
    )]
    NoValley {
        /// Step of the best division, in mm.
        depth_mm: f64,
    },
    /// Two levels are there, but no part of one is wide enough to be measured beyond the reach of its walls.
    #[error(
        "two levels are there, some {depth_mm:.2} mm apart, but they are too narrow to be measured: no pixel of one of them \
         lies farther than {margin_px} px from the other; bring the camera nearer, so that more pixels see them"
    )]
    TooNarrow {
        /// Distance from the walls that is left out, in px.
        margin_px: usize,
        /// About how far the levels are apart, in mm: walls make it less.
        depth_mm: f64,
    },
    /// A cut-off that the pixels or the other filter do not allow.
    #[error(
        "the cut-off of the {filter} is {cutoff_mm} mm, but it must be {least_mm:.4} mm or more: at least three pixels, and that of the L-filter \
         above that of the S-filter"
    )]
    CutOff {
        /// `S-filter` or `L-filter`.
        filter: &'static str,
        /// What was asked for, in mm.
        cutoff_mm: f64,
        /// The least, in mm.
        least_mm: f64,
    },
    /// A region whose heights determine no plane.
    #[error(
        "the region determines no plane: {pixels} of its pixels have a height, too few or all in a line; choose a larger region, or another one"
    )]
    NoPlane {
        /// Pixels of the region with height and sigma.
        pixels: usize,
    },
    /// A point of a plane without a height.
    #[error("no height is known about the point ({x}, {y}) px; choose another point")]
    NoPoint {
        /// Column of the point.
        x: usize,
        /// Row of the point.
        y: usize,
    },
    /// Three points that determine no plane.
    #[error("the three points lie in a line, so that they determine no plane; choose others")]
    InLine,
    /// A profile that would leave the picture.
    #[error(
        "the profile's end at {x}, {y} lies outside the picture of {columns} x {rows} px; give ends in it"
    )]
    LineOutside {
        /// Column of the end, in px.
        x: f64,
        /// Row of the end.
        y: f64,
        /// Columns of the picture.
        columns: usize,
        /// Rows of the picture.
        rows: usize,
    },
    /// A line that shows nothing.
    #[error(
        "no height is known along the line from ({}, {}) to ({}, {}) px; choose a line over the object",
        from.0, from.1, to.0, to.1
    )]
    EmptyLine {
        /// First column and row.
        from: (f64, f64),
        /// Last column and row.
        to: (f64, f64),
    },
}

impl Fault for SurfaceError {
    fn blame(&self) -> Blame {
        match self {
            Self::EmptyLine { .. }
            | Self::LineOutside { .. }
            | Self::NoPlane { .. }
            | Self::NoPoint { .. }
            | Self::InLine => Blame::Request,
            Self::TooFewPixels { .. }
            | Self::NoExtent { .. }
            | Self::Undetermined { .. }
            | Self::OneLevel { .. }
            | Self::NoValley { .. }
            | Self::TooNarrow { .. }
            | Self::CutOff { .. } => Blame::Data,
        }
    }
}
