//! How far parts of a picture have moved: block matching by correlation, coarse and then fine.

use super::reduced::Reduced;
use crate::block::Block;
use epirig_core::grid::Grid;

/// Side of a block and distance of blocks, in pixels of the coarse picture.
const SIDE: usize = 20;
const PITCH: usize = 24;
/// Farthest shift that is looked for, in pixels of the coarse picture.
const REACH: isize = 12;
/// Blocks correlate at least so well, or they do not show the same thing.
const LEAST_CORRELATION: f32 = 0.7;
/// Another shift that correlates as well, less this, leaves it open which is true.
const AMBIGUOUS: f32 = 0.06;
/// Fall of the correlation from its peak to one pixel beside it: less leaves the shift along that axis open.
const LEAST_FALL: f32 = 0.004;

/// Whither a block has moved that was found again: columns and rows, in pixels of the reduced picture.
pub(super) type Shift = (f32, f32);

/// Shifts of the blocks of `from` on their way to `to`, of those that were found again at one place.
pub(super) fn shifts(from: &Reduced, to: &Reduced) -> Vec<Shift> {
    let mut shifts = Vec::new();
    let (rows, columns) = (from.coarse.rows(), from.coarse.columns());
    if (to.coarse.rows(), to.coarse.columns()) != (rows, columns) {
        return shifts;
    }
    for top in (0..rows.saturating_sub(SIDE - 1)).step_by(PITCH) {
        for left in (0..columns.saturating_sub(SIDE - 1)).step_by(PITCH) {
            let Some(block) = Block::of(&from.coarse, top, left, SIDE) else { continue };
            let start = coarse_shift(&block, &to.coarse);
            shifts.extend(start.and_then(|start| fine_shift(from, to, top, left, start)));
        }
    }
    shifts
}

/// The shift by whole pixels at which the block correlates best, if no other does nearly as well.
fn coarse_shift(block: &Block, to: &Grid<f32>) -> Option<(isize, isize)> {
    let all = (-REACH..=REACH).flat_map(|y| (-REACH..=REACH).map(move |x| (x, y)));
    let tried: Vec<_> = all.filter_map(|(x, y)| Some((block.correlation(to, x, y)?, x, y))).collect();
    let &(best, x, y) = tried.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let is_far = |other_x: isize, other_y: isize| (other_x - x).abs().max((other_y - y).abs()) > 2;
    let rival = tried.iter().filter(|(_, other_x, other_y)| is_far(*other_x, *other_y)).map(|tried| tried.0);
    let second = rival.fold(0.0_f32, f32::max);
    (best >= LEAST_CORRELATION * 0.9 && second < best - AMBIGUOUS).then_some((x, y))
}

/// The shift in parts of a pixel, from that of the coarse picture.
fn fine_shift(from: &Reduced, to: &Reduced, top: usize, left: usize, start: (isize, isize)) -> Option<Shift> {
    let block = Block::of(&from.fine, 2 * top, 2 * left, 2 * SIDE)?;
    let near = (-2..=2).flat_map(|y| (-2..=2).map(move |x| (2 * start.0 + x, 2 * start.1 + y)));
    let tried = near.filter_map(|(x, y)| Some((block.correlation(&to.fine, x, y)?, x, y)));
    let (best, x, y) = tried.max_by(|a, b| a.0.total_cmp(&b.0))?;
    if best < LEAST_CORRELATION {
        return None;
    }
    let parabola = |before: f32, after: f32| {
        let (fall_before, fall_after) = (best - before, best - after);
        let is_peak = fall_before >= 0.0 && fall_after >= 0.0 && fall_before + fall_after >= 2.0 * LEAST_FALL;
        is_peak.then(|| 0.5 * (fall_before - fall_after) / (fall_before + fall_after))
    };
    let beside = |dx, dy| block.correlation(&to.fine, x + dx, y + dy);
    let part_x = parabola(beside(-1, 0)?, beside(1, 0)?)?;
    let part_y = parabola(beside(0, -1)?, beside(0, 1)?)?;
    Some((x as f32 + part_x, y as f32 + part_y))
}
