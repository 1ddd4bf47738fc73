//! Points of a flat board as a frame shows them.

use serde::{Deserialize, Serialize};

/// A point of a flat board and where it was seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanarPoint {
    /// Place on the board, in mm.
    pub x_mm: f64,
    /// Place on the board, in mm.
    pub y_mm: f64,
    /// Column where it was seen, in px.
    pub x_px: f64,
    /// Row where it was seen, in px.
    pub y_px: f64,
    /// Standard deviation of column and row each, in px; above 0. A common factor does not matter.
    pub sigma_px: f64,
}

/// The points of the board that one frame shows; at least eight that are not on a line. They need not be all.
pub type View = Vec<PlanarPoint>;
