//! Chess-boards in a picture.

use std::sync::Arc;

use crate::panel::shared::{COLUMNS, ROWS, SharedState};
use crate::panel::state::TargetState;
use epirig_calibration::target::{ChessBoard, FoundBoard, find_boards};
use epirig_core::frame::Frame;

/// Whether the profile describes a chess-board.
pub(in crate::panel) fn has_target(shared: &SharedState) -> bool {
    shared
        .draft()
        .profile()
        .is_ok_and(|profile| profile.board.chess_board().is_some() || profile.target.print().is_some())
}

/// Whether a simulated camera can be shown the chess-board that is held by hand.
pub(in crate::panel) fn shows_board(shared: &SharedState) -> bool {
    shared.draft().profile().is_ok_and(|profile| profile.board.chess_board().is_some())
}

/// The board of the profile in `frame`: the one held by hand, or else those on the object. With `covers`, its
/// corners count as seen. `None` if the profile describes no board.
pub(in crate::panel) fn find_target(
    shared: &Arc<SharedState>,
    frame: &Frame,
    covers: bool,
) -> Option<TargetState> {
    let profile = shared.draft().profile().ok()?;
    let by_hand = profile.board.chess_board().map(|board| search("board", board, 1, frame));
    let printed = || {
        let print = profile.target.print()?;
        Some(search("target", print.board, print.bands, frame))
    };
    let mut target = match by_hand {
        Some(found) if !found.corners.is_empty() => Some(found),
        missing => printed().or(missing),
    }?;
    let corners = if covers && target.complete { target.corners.clone() } else { Vec::new() };
    target.coverage = shared.change(|state| {
        state.coverage.add(&corners, frame.columns(), frame.rows());
        state.coverage.seen().to_vec()
    });
    Some(target)
}

fn search(name: &'static str, board: ChessBoard, count: usize, frame: &Frame) -> TargetState {
    let found: Vec<FoundBoard> = find_boards(frame, &board, count);
    let corners: Vec<[f64; 2]> = found
        .iter()
        .flat_map(|board| &board.corners)
        .map(|corner| [corner.corner.x_px, corner.corner.y_px])
        .collect();
    TargetState {
        name,
        wanted: count * board.columns * board.rows,
        complete: found.len() == count && found.iter().all(|board| board.complete),
        corners,
        blur_px: found.first().map(|board| board.blur_px),
        coverage_columns: COLUMNS,
        coverage_rows: ROWS,
        coverage: Vec::new(),
    }
}
