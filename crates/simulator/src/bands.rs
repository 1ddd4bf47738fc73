//! Chess-boards printed along two edges of the tile.

use serde::{Deserialize, Serialize};

use super::chess::Chess;
use super::error::{SimulatorError, require, require_positive};

/// Chess-boards along the upper and the lower edge of a tile: `columns` x `rows` squares each, in the middle
/// between left and right. There the tile has no hollows. To the left and to the right of the squares it is
/// white paper. Edges of squares are soft by 0.45 px of the image; squares of less than 4 px alias.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bands {
    /// Side of a square, in mm.
    pub square_mm: f64,
    /// Squares along x; at least 2.
    pub columns: usize,
    /// Squares along y, of one band; at least 2.
    pub rows: usize,
}

impl Bands {
    /// Where the bands of a tile of this side begin: their |v|, in mm.
    pub(super) fn start_mm(&self, side_mm: f64) -> f64 {
        0.5 * side_mm - self.rows as f64 * self.square_mm
    }

    /// Whether they fit on a tile that needs walls of `wall_mm` before them.
    pub(super) fn check(&self, side_mm: f64, wall_mm: f64) -> Result<(), SimulatorError> {
        require_positive("squares of the bands in mm", self.square_mm)?;
        let (columns, rows) = (self.columns as f64, self.rows as f64);
        let fits = self.columns >= 2 && columns * self.square_mm <= side_mm;
        require(fits, "number of squares along a band", columns, "at least 2, and fit on the tile")?;
        let has_room = self.rows >= 2 && self.start_mm(side_mm) > wall_mm;
        let expected = "at least 2, and leave room between the bands";
        require(has_room, "number of squares across a band", rows, expected)
    }
}

/// The bands, ready to be looked at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Print {
    chess: Chess,
    start_mm: f64,
    middle_mm: f64,
}

impl Print {
    /// Bands on a tile of side `side_mm`, with edges of standard deviation `softness_mm`.
    pub(super) fn new(bands: &Bands, side_mm: f64, softness_mm: f64) -> Self {
        let start_mm = bands.start_mm(side_mm);
        Self {
            chess: Chess::new(bands.square_mm, bands.columns, bands.rows, softness_mm),
            start_mm,
            middle_mm: 0.5 * (start_mm + 0.5 * side_mm),
        }
    }

    /// How much of a place is covered by a band, 0 to 1, and the reflectance there; `None` well between the
    /// bands.
    #[inline]
    pub(super) fn at(&self, u: f64, v: f64) -> Option<(f64, f64)> {
        let softness_mm = self.chess.softness_mm();
        let beyond = v.abs() - self.start_mm;
        // Six standard deviations: 1e-9 of the paper is left.
        if beyond < -6.0 * softness_mm {
            return None;
        }
        let from_middle = v - self.middle_mm.copysign(v);
        Some((super::chess::step(beyond, softness_mm), self.chess.reflectance(u, from_middle)))
    }

    /// Inner corners: (band, column, row, u, v); band 0 is the upper one.
    pub(super) fn corners(self) -> impl Iterator<Item = (usize, usize, usize, f64, f64)> {
        let middles = [-self.middle_mm, self.middle_mm];
        middles.into_iter().enumerate().flat_map(move |(band, middle)| {
            self.chess.corners().map(move |(column, row, u, v)| (band, column, row, u, middle + v))
        })
    }
}
