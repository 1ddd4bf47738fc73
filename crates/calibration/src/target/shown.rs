//! Whether boards are as large as they are said to be.

use std::collections::BTreeMap;

use super::board::{ChessBoard, FoundBoard};

/// What boards show of their size, against what was told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OtherSize {
    /// Inner corners along a row that they show.
    pub columns: usize,
    /// Inner corners along a column that they show.
    pub rows: usize,
    /// Whether they may be even larger: only the next line at each side is looked at.
    pub at_least: bool,
    /// Number of boards that show this size.
    pub boards: usize,
    /// Number of boards that show a size.
    pub of: usize,
}

/// The size that most of the `found` boards show, in frames of rows x columns, if it is not that of `board`. A board
/// shows its size if it is complete, or ends inside the frame.
pub fn other_size<'a>(
    found: impl IntoIterator<Item = &'a FoundBoard>,
    board: &ChessBoard,
    frame_size: (usize, usize),
) -> Option<OtherSize> {
    let told = (board.columns, board.rows);
    let mut sizes: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    for shown in found.into_iter().filter_map(|found| shown(found, board, frame_size)) {
        *sizes.entry(shown).or_default() += 1;
    }
    let of = sizes.values().sum();
    let (&(columns, rows), &boards) = sizes.iter().max_by_key(|&(_, &boards)| boards)?;
    let at_least = columns > board.columns || rows > board.rows;
    let contradicts = (columns, rows) != told && 2 * boards > of;
    contradicts.then_some(OtherSize { columns, rows, at_least, boards, of })
}

/// Columns and rows of a board, if it shows them.
fn shown(found: &FoundBoard, board: &ChessBoard, frame_size: (usize, usize)) -> Option<(usize, usize)> {
    if found.complete {
        return Some((board.columns + found.more.0, board.rows + found.more.1));
    }
    // With a gap in the rectangle, it is a corner that is missing, and perhaps a line.
    let (columns, rows) = found.size();
    let is_full = found.corners.len() == columns * rows;
    let ends = |short: bool, dc, dr| !short || !found.leaves(dc, dr, frame_size);
    let shows_both = ends(columns < board.columns, 1, 0) && ends(rows < board.rows, 0, 1);
    (is_full && shows_both).then_some((columns, rows))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::target::{BoardCorner, Corner};

    const BOARD: ChessBoard = ChessBoard { square_mm: 10.0, columns: 5, rows: 4 };
    const FRAME: (usize, usize) = (200, 300);

    /// A board of columns x rows corners, 20 px apart, from `x` on.
    fn found(columns: i32, rows: i32, x: f64, more: (usize, usize)) -> FoundBoard {
        let corner = |column: i32, row: i32| {
            let (x_px, y_px) = (x + 20.0 * f64::from(column), 50.0 + 20.0 * f64::from(row));
            let corner = Corner { x_px, y_px, sigma_px: 0.01, contrast_dn: 80.0, blur_px: 0.8 };
            BoardCorner { column, row, corner }
        };
        let corners = (0..rows).flat_map(|row| (0..columns).map(move |column| corner(column, row)));
        FoundBoard {
            corners: corners.collect(),
            complete: (columns, rows) == (5, 4),
            even_dark: true,
            more,
            blur_px: 0.8,
            contrast_dn: 80.0,
        }
    }

    #[test]
    fn boards_of_the_size_that_was_told_contradict_nothing() {
        let whole = found(5, 4, 50.0, (0, 0));
        assert_eq!(other_size(&[whole.clone(), whole], &BOARD, FRAME), None);
        assert_eq!(other_size(&[], &BOARD, FRAME), None);
    }

    #[test]
    fn a_larger_board_goes_on_and_a_smaller_one_ends() {
        let larger = found(5, 4, 50.0, (1, 1));
        let told = OtherSize { columns: 6, rows: 5, at_least: true, boards: 3, of: 3 };
        assert_eq!(other_size(&vec![larger; 3], &BOARD, FRAME), Some(told));
        let smaller = found(4, 4, 50.0, (0, 0));
        let told = OtherSize { columns: 4, rows: 4, at_least: false, boards: 2, of: 3 };
        let whole = found(5, 4, 50.0, (0, 0));
        assert_eq!(other_size(&[smaller.clone(), whole.clone(), smaller.clone()], &BOARD, FRAME), Some(told));
        assert_eq!(other_size(&[smaller, whole], &BOARD, FRAME), None, "as many say the one as the other");
    }

    #[test]
    fn boards_that_leave_the_frame_or_have_gaps_show_no_size() {
        // The next column would lie at -15 px.
        let cut = found(4, 4, 5.0, (0, 0));
        let mut gap = found(4, 4, 50.0, (0, 0));
        gap.corners.remove(5);
        assert_eq!(other_size(&[cut, gap], &BOARD, FRAME), None);
    }
}
