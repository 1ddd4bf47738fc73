//! Chess-board targets: found in frames to a hundredth of a pixel, labelled, followed through a sequence, and printed.
//!
//! A board is named by its inner corners, columns x rows, as in OpenCV. [`find_boards`] finds boards in one frame, [`track`] says which corner is
//! which in all frames of a sequence, [`mod@print`] makes the sheet.

mod detect;
mod label;
mod lattice;
pub mod print;
mod refine;
mod sampling;
#[cfg(test)]
mod tests;
mod tracks;

use thiserror::Error;

use epirig_core::frame::Frame;
use epirig_core::grid::Grid;

pub use refine::{Corner, EdgeCross, refine_corner};
pub use tracks::{Observation, TrackedCorner, Tracks, track};

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
    /// How many times: 1 or 2.
    pub bands: usize,
    /// From the first row of corners of the first band to that of the second, in mm; without meaning for one band.
    pub band_distance_mm: f64,
}

/// A corner of a board with its label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardCorner {
    /// Column, counted along the board's rows; of a partial board relative to the others.
    pub column: i32,
    /// Row; the turn from columns to rows is that from x to y. Of a partial board relative to the others.
    pub row: i32,
    /// Where it is.
    pub corner: Corner,
}

/// A board, or a part of one, in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundBoard {
    /// Its corners, row by row; at most as many as the board has, and no label twice.
    pub corners: Vec<BoardCorner>,
    /// Whether all corners are there. If so, labels are the board's own: columns from 0, rows from 0.
    pub complete: bool,
    /// Whether a dark square lies between the directions to lower columns and to lower rows of corners with an even sum of column and row. Always so
    /// for partial boards and for boards with an odd sum of columns and rows.
    pub even_dark: bool,
    /// Blur of the edges, in px: the median of its corners.
    pub blur_px: f64,
    /// Half the step from black to white, in DN: the median of its corners.
    pub contrast_dn: f64,
}

/// Why a target cannot be printed, or corners cannot be told apart.
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
    /// One band is never seen, or cannot be told from the other.
    #[error(
        "the two bands of the target cannot be told apart: {reason}; put both bands into view in some frames, or describe the target as one band"
    )]
    Bands {
        /// What was seen.
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
        /// Views there are.
        boards: usize,
    },
}

impl ChessBoard {
    /// How many corners it has.
    pub fn corners(&self) -> usize {
        self.columns * self.rows
    }

    /// # Errors
    /// [`TargetError::Description`] for less than 2 x 2 corners, or squares without a size.
    pub fn check(&self) -> Result<(), TargetError> {
        let wrong = |reason: String| Err(TargetError::Description { reason });
        /// More each way than any camera can count.
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
    /// # Errors
    /// [`TargetError::Description`] for an impossible board, another number of bands than 1 or 2, or bands that overlap.
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
    /// Whether corners fill a rectangle of labels, and the next columns or rows, where the board has more, are beyond the image's border.
    fn is_cut_off(&self, board: &ChessBoard, (rows, columns): (usize, usize)) -> bool {
        let span = |of: fn(&BoardCorner) -> i32| {
            let labels = || self.corners.iter().map(of);
            labels().max().zip(labels().min()).map_or(0, |(last, first)| (last - first + 1) as usize)
        };
        let (wide, high) = (span(|corner| corner.column), span(|corner| corner.row));
        let outside =
            |x: f64, y: f64| !((0.0..columns as f64).contains(&x) && (0.0..rows as f64).contains(&y));
        let leaves = |dc: i32, dr: i32| {
            self.corners.iter().any(|here| {
                let is_next =
                    |other: &&BoardCorner| (other.column, other.row) == (here.column + dc, here.row + dr);
                self.corners.iter().find(is_next).is_some_and(|next| {
                    let (a, b) = (&here.corner, &next.corner);
                    outside(2.0 * a.x_px - b.x_px, 2.0 * a.y_px - b.y_px)
                        || outside(2.0 * b.x_px - a.x_px, 2.0 * b.y_px - a.y_px)
                })
            })
        };
        self.corners.len() == wide * high
            && (wide >= board.columns || leaves(1, 0))
            && (high >= board.rows || leaves(0, 1))
    }
}

/// Edges that are blurred less are found at full size, in px: detection smooths them as much again.
const SHARP_PX: f64 = 1.4;

/// Finds up to `count` boards in a frame, those with most corners first. Parts of boards count from six corners on.
///
/// A complete board is labelled by this rule. Column to row turns as x to y, so boards are never mirrored. If the sum of columns and rows is odd, half
/// a turn swaps the colours, and corner (0, 0) is the one whose outermost square is dark: the same corner in every view. If it is even, half a
/// turn changes nothing, and columns run to the right as seen (rows downwards, if there are as many rows as columns and a quarter turn
/// changes nothing, either). A partial board has columns along the direction nearest to the image's x, to the right, if its size allows that; its labels begin
/// near 0 and are right up to a shift by an even sum, since corners with an even sum have a dark square before them ([`FoundBoard::even_dark`]).
pub fn find_boards(frame: &Frame, board: &ChessBoard, count: usize) -> Vec<FoundBoard> {
    let mut samples = vec![0.0_f32; frame.samples().len()];
    frame.samples().copy_to_f32(0, &mut samples);
    let Some(image) = Grid::from_values(frame.rows(), frame.columns(), samples) else { return Vec::new() };
    let found = label::boards(&image, 1, board, count);
    // What is sharp at full size is not found better at half of it: the rest of the board is out of view.
    let size = (frame.rows(), frame.columns());
    let all_in_view =
        |found: &FoundBoard| found.complete || (found.blur_px < SHARP_PX && found.is_cut_off(board, size));
    let enough = found.len() >= count && found.iter().all(all_in_view);
    if enough || board.check().is_err() {
        return found;
    }
    // Edges that are blurred over many pixels are sharp at half the size.
    let coarse = label::boards(&image, 2, board, count);
    let corners = |boards: &[FoundBoard]| boards.iter().map(|board| board.corners.len()).sum::<usize>();
    if corners(&coarse) > corners(&found) { coarse } else { found }
}
