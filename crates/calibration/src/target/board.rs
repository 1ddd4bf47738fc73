//! Boards as they are described, and as they are found.

use super::error::TargetError;
use super::refine::Corner;

/// A chess-board, counted by the corners at which four squares meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChessBoard {
    /// Inner corners along a row: one less than squares.
    pub columns: usize,
    /// Inner corners along a column: one less than squares.
    pub rows: usize,
    /// Side of a square, in mm.
    pub square_mm: f64,
}

/// One chess-board, or the same one twice: a band before and a band behind the measured area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// The board that is printed once or twice.
    pub board: ChessBoard,
    /// Number of times: 1 or 2.
    pub bands: usize,
    /// Distance from the first row of corners of the first band to that of the second, in mm; without meaning
    /// for one band.
    pub band_distance_mm: f64,
}

/// A corner of a board with its label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardCorner {
    /// Column, counted along the board's rows; of a partial board relative to the others.
    pub column: i32,
    /// Row; the turn from columns to rows is that from x to y. Of a partial board relative to the others.
    pub row: i32,
    /// Its place in the image.
    pub corner: Corner,
}

/// A board, or a part of one, in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundBoard {
    /// Its corners, row by row; at most as many as the board has, and no label twice.
    pub corners: Vec<BoardCorner>,
    /// Whether all corners are there. If so, labels are the board's own: columns from 0, rows from 0.
    pub complete: bool,
    /// Whether a dark square lies between the directions to lower columns and to lower rows of corners with
    /// an even sum of column and row. Always so for partial boards and for boards with an odd sum of columns
    /// and rows.
    pub even_dark: bool,
    /// Columns and rows of corners that go on beyond those of the board. Only of a complete board, and only
    /// the next line at each side, is looked at: 0 to 2.
    pub more: (usize, usize),
    /// Blur of the edges, in px: the median of its corners.
    pub blur_px: f64,
    /// Half the step from black to white, in DN: the median of its corners.
    pub contrast_dn: f64,
}

impl ChessBoard {
    /// Number of inner corners.
    pub fn corners(&self) -> usize {
        self.columns * self.rows
    }

    /// Checks that such a board can be made.
    ///
    /// # Errors
    /// [`TargetError::Description`] for less than 2 x 2 corners, or squares without a size.
    pub fn check(&self) -> Result<(), TargetError> {
        let wrong = |reason: String| Err(TargetError::Description { reason });
        /// More corners each way than any camera can count.
        const MOST: usize = 1000;
        if self.columns.min(self.rows) < 2 || self.columns.max(self.rows) > MOST {
            return wrong(format!("{} x {} inner corners", self.columns, self.rows));
        }
        if !(1e-9..=1e9).contains(&self.square_mm) {
            return wrong(format!("squares of {} mm", self.square_mm));
        }
        Ok(())
    }
}

impl Target {
    /// Checks that such a target can be made.
    ///
    /// # Errors
    /// [`TargetError::Description`] for an impossible board, another number of bands than 1 or 2, or bands
    /// that overlap.
    pub fn check(&self) -> Result<(), TargetError> {
        self.board.check()?;
        let wrong = |reason: String| Err(TargetError::Description { reason });
        if !(1..=2).contains(&self.bands) {
            return wrong(format!("{} bands, where 1 or 2 are known", self.bands));
        }
        // A band is one square higher than its rows of corners reach apart, on either side.
        let band_mm = (self.board.rows + 1) as f64 * self.board.square_mm;
        if self.bands == 2 && !(band_mm..=1e12).contains(&self.band_distance_mm) {
            return wrong(format!(
                "bands {} mm apart that are {band_mm} mm high each overlap",
                self.band_distance_mm
            ));
        }
        Ok(())
    }
}

impl FoundBoard {
    /// Columns and rows that its corners span.
    pub(super) fn size(&self) -> (usize, usize) {
        let span = |of: fn(&BoardCorner) -> i32| {
            let labels = || self.corners.iter().map(of);
            labels().max().zip(labels().min()).map_or(0, |(last, first)| (last - first + 1) as usize)
        };
        (span(|corner| corner.column), span(|corner| corner.row))
    }

    /// Whether the next column (1, 0) or row (0, 1) at either side is beyond the border of an image of rows x
    /// columns.
    pub(super) fn leaves(&self, dc: i32, dr: i32, (rows, columns): (usize, usize)) -> bool {
        let outside =
            |x: f64, y: f64| !((0.0..columns as f64).contains(&x) && (0.0..rows as f64).contains(&y));
        self.corners.iter().any(|here| {
            let is_next =
                |other: &&BoardCorner| (other.column, other.row) == (here.column + dc, here.row + dr);
            self.corners.iter().find(is_next).is_some_and(|next| {
                let (a, b) = (&here.corner, &next.corner);
                outside(2.0 * a.x_px - b.x_px, 2.0 * a.y_px - b.y_px)
                    || outside(2.0 * b.x_px - a.x_px, 2.0 * b.y_px - a.y_px)
            })
        })
    }

    /// Whether corners fill a rectangle of labels, and the next columns or rows, where the board has more,
    /// are beyond the image's border.
    pub(super) fn is_cut_off(&self, board: &ChessBoard, size: (usize, usize)) -> bool {
        let (wide, high) = self.size();
        self.corners.len() == wide * high
            && (wide >= board.columns || self.leaves(1, 0, size))
            && (high >= board.rows || self.leaves(0, 1, size))
    }
}
