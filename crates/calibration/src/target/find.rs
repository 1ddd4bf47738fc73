//! Boards in one frame.

use super::board::{ChessBoard, FoundBoard};
use super::label;
use epirig_core::frame::Frame;
use epirig_core::image::reduced_frame;

/// Edges that are blurred less are found at full size, in px: detection smooths them as much again.
const SHARP_PX: f64 = 1.4;

/// Finds up to `count` boards in a frame, those with most corners first. Parts of boards count from six
/// corners on.
///
/// A complete board is labelled by this rule. Column to row turns as x to y, so boards are never mirrored. If
/// the sum of columns and rows is odd, half a turn swaps the colours, and corner (0, 0) is the one whose
/// outermost square is dark: the same corner in every view. If it is even, half a turn changes nothing, and
/// columns run to the right as seen (rows downwards, if there are as many rows as columns and a quarter turn
/// changes nothing, either). A partial board has columns along the direction nearest to the image's x, to the
/// right, if its size allows that; its labels begin near 0 and are right up to a shift by an even sum, since
/// corners with an even sum have a dark square before them ([`FoundBoard::even_dark`]).
pub fn find_boards(frame: &Frame, board: &ChessBoard, count: usize) -> Vec<FoundBoard> {
    let image = reduced_frame(frame, 1);
    let found = label::boards(&image, 1, board, count);
    // A board that is sharp at full size is not found better at half of it: the rest of it is out of view.
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
