//! Labels of the corners in all frames of a sequence.
//!
//! At a fixed point of the image, the label of a board that moves straight and evenly grows evenly: exactly
//! so if the board moves in its own plane, whatever the camera's direction. So all views share one map from
//! the image to labels, each with an offset of its own (`plane_map`). Complete boards have their labels;
//! partial ones take the shift for which all offsets lie on one straight line over the stage's position
//! (`motion`).

mod motion;
mod plane_map;
#[cfg(test)]
mod tests;
mod views;

use std::collections::BTreeSet;

use super::board::{FoundBoard, Target};
use super::error::TargetError;
use motion::{Line, solve};
use plane_map::PlaneMap;
use views::{View, views};

/// A corner this far from its place on the board, in squares, does not belong to the board. A lens whose
/// distortion is a percent moves corners by some hundredths of a square against the map.
const FALSE_SQUARES: f64 = 0.15;

/// A corner of the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct TrackedCorner {
    /// Band: 0 for the upper one, or, if the board stands on its head, the one that comes first along its
    /// rows.
    pub band: usize,
    /// Row within the band, from 0.
    pub row: i32,
    /// Column within the band, from 0.
    pub column: i32,
}

/// Where a corner was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// The frame, from 0.
    pub frame: usize,
    /// The corner, as an index into [`Tracks::corners`].
    pub corner: usize,
    /// Column, in px.
    pub x_px: f64,
    /// Row, in px.
    pub y_px: f64,
    /// Standard deviation of either, in px.
    pub sigma_px: f64,
}

/// All corners through all frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracks {
    /// Corners that were seen, in the order of band, row and column.
    pub corners: Vec<TrackedCorner>,
    /// Where they were seen, in the order of frames.
    pub observations: Vec<Observation>,
    /// Corners that were found but are in no track: they fit no label, or not the motion.
    pub dropped: usize,
    /// For each band whether its labels are the target's own. If not, all of them may be off by one shift,
    /// the same in all frames, because no frame shows where the band begins or ends; motion and distances
    /// between corners of the band are right nevertheless.
    pub anchored: Vec<bool>,
}

/// Follows the corners of a target through the boards found in the frames, one entry for each frame, in
/// order.
///
/// The target moves straight, and evenly with `positions_mm`, or from frame to frame, if no positions are
/// given. Boards may be partly or wholly out of view in any frame. Positions also decide between labellings
/// that fit equally well: a board of known squares moves by one square per `square_mm`.
///
/// # Errors
/// [`TargetError`] for an impossible target, positions that are not one for each frame, no board at all,
/// bands that cannot be told apart, a motion that is not straight and even, or labels that cannot be decided.
pub fn track(
    found: &[Vec<FoundBoard>],
    target: &Target,
    positions_mm: Option<&[f64]>,
) -> Result<Tracks, TargetError> {
    target.check()?;
    let positions: Vec<f64> = match positions_mm {
        Some(given) if given.len() != found.len() || given.iter().any(|value| !value.is_finite()) => {
            return Err(TargetError::Positions { positions: given.len(), frames: found.len() });
        }
        Some(given) => given.to_vec(),
        None => (0..found.len()).map(|frame| frame as f64).collect(),
    };
    let views = views(found, target, &positions)?;
    let map = PlaneMap::new(&views);
    let offsets: Vec<[f64; 2]> = views.iter().map(|view| map.offset(view)).collect();
    let lines = solve(&views, &offsets, target, positions_mm.is_some())?;
    Ok(assemble(found, &views, &map, &offsets, &lines))
}

fn assemble(
    found: &[Vec<FoundBoard>],
    views: &[View],
    map: &PlaneMap,
    offsets: &[[f64; 2]],
    lines: &[Line],
) -> Tracks {
    let mut seen = Vec::new();
    for (index, (view, offset)) in views.iter().zip(offsets).enumerate() {
        let Some(&(columns, rows)) = lines[view.band].shifts.get(&index) else { continue };
        for corner in &view.corners {
            let label = (corner.column + columns, corner.row + rows);
            let [column, row] = map.residual(corner, offset);
            if lines[view.band].holds(label) && column.hypot(row) < FALSE_SQUARES {
                let tracked = TrackedCorner { band: view.band, row: label.1, column: label.0 };
                seen.push((view.frame, tracked, corner.corner));
            }
        }
    }
    seen.sort_by_key(|&(frame, corner, _)| (frame, corner));
    let corners: Vec<TrackedCorner> =
        seen.iter().map(|&(_, corner, _)| corner).collect::<BTreeSet<_>>().into_iter().collect();
    let mut observations = Vec::with_capacity(seen.len());
    for (frame, tracked, corner) in seen {
        // Every corner that was seen is in the list.
        let Ok(index) = corners.binary_search(&tracked) else { continue };
        let (x_px, y_px, sigma_px) = (corner.x_px, corner.y_px, corner.sigma_px);
        observations.push(Observation { frame, corner: index, x_px, y_px, sigma_px });
    }
    let all: usize = found.iter().flatten().map(|board| board.corners.len()).sum();
    Tracks {
        dropped: all - observations.len(),
        corners,
        observations,
        anchored: lines.iter().map(|line| line.anchored).collect(),
    }
}
