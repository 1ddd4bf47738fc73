//! What the boards of a lens and of a target have in common.

use super::CalibrateError;
use epirig_calibration::target::{ChessBoard, FoundBoard, other_size};

/// Largest blur of edges, as a standard deviation in px. With more blur, the location of a corner depends on
/// the shape of the blur, which varies over the field.
pub(super) const MOST_BLUR_PX: f64 = 3.0;

/// Refuses boards that are of another size than `board`, which `section` of the profile describes, in frames of
/// rows x columns.
pub(super) fn refuse_other_size<'a>(
    section: &'static str,
    found: impl IntoIterator<Item = &'a FoundBoard>,
    board: &ChessBoard,
    frame_size: (usize, usize),
) -> Result<(), CalibrateError> {
    let told = (board.columns, board.rows);
    match other_size(found, board, frame_size) {
        Some(shown) => Err(CalibrateError::OtherBoard { section, told, shown }),
        None => Ok(()),
    }
}
