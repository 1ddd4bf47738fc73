//! The first two frames, in small pictures: how far points of one have moved in the other.

use rayon::prelude::*;

use super::frames::Frames;
use super::point::squares;
use crate::block::Block;
use epirig_core::grid::Grid;
use epirig_core::statistics::median;

/// Side of the squares that are looked for, in px of the small pictures.
pub(super) const SIDE: usize = 12;
/// Squares of a picture that are looked for in others, at most.
pub(super) const POINTS: usize = 120;
/// Fewest points that speak for a motion.
pub(super) const FEWEST: usize = 4;
/// Squares correlate at least so well, or they do not show the same thing. Views of one texture correlate by
/// S / (S + N) with variances S of the texture and N of the noise, so N may be half of S. Squares of 144 independent
/// pixels that have nothing in common correlate by less than 0.25, three times 1 / 12.
pub(super) const LEAST_CORRELATION: f32 = 0.65;
/// Another place that correlates as well, less this, leaves it open which is true. A correlation c of n pixels has a
/// standard deviation of (1 - c^2) / sqrt(n), which is 0.03 for 0.8 and 144 pixels: this is twice that.
pub(super) const AMBIGUOUS: f32 = 0.06;
/// Places nearer than this are one, in px.
pub(super) const ONE_PLACE_PX: f64 = 2.5;
/// Points move if they go at least so far, and a motion is clear from this size on, in px.
pub(super) const MOVES_PX: f64 = 0.5;
pub(super) const CLEAR_PX: f64 = 1.5;
/// Share of the moving squares that must agree on a direction: a majority, so that no other direction has as many. Of
/// squares that are found at random places, one in twenty agrees.
pub(super) const AGREE_ON_DIRECTION: f64 = 0.6;

/// Where a parabola through three values has its peak, from the middle one.
pub(super) fn peak(before: f32, here: f32, after: f32) -> f64 {
    let (before, after) = (f64::from(here - before), f64::from(here - after));
    if before + after > 0.0 { (0.5 * (before - after) / (before + after)).clamp(-0.5, 0.5) } else { 0.0 }
}

/// Two frames, and how far points of the first have moved in the second, in px of the small pictures.
pub(super) struct Start {
    pub(super) anchor: usize,
    pub(super) other: usize,
    pub(super) points: Vec<(Block, f64)>,
    pub(super) direction: [f64; 2],
    pub(super) moved_px: f64,
}

/// Two frames between which points move, clearly if there are such. Two pictures are held at a time.
pub(super) fn start(frames: &dyn Frames, factor: usize, reach: Option<isize>) -> Option<Start> {
    let last = frames.count() - 1;
    let mut best: Option<Start> = None;
    for anchor in [last / 2, last / 4, last - last / 4, 0] {
        let from = frames.picture(anchor, factor);
        let blocks = squares(&from, SIDE, POINTS, [1.0, 0.0]);
        let distances =
            std::iter::successors(Some(1), |distance| Some(2 * distance)).take_while(|d| *d <= last);
        for distance in distances {
            let others = [anchor.checked_add(distance), anchor.checked_sub(distance)];
            for other in others.into_iter().flatten().filter(|&other| other <= last) {
                let found = found_between(&from, &frames.picture(other, factor), &blocks, reach);
                let Some((points, direction, moved_px)) = agreeing(found) else { continue };
                if best.as_ref().is_none_or(|best| moved_px > best.moved_px) {
                    best = Some(Start { anchor, other, points, direction, moved_px });
                }
                if moved_px >= CLEAR_PX {
                    return best;
                }
            }
        }
    }
    best
}

type Moved = (Vec<(Block, f64)>, [f64; 2], f64);

/// How far squares have moved between two pictures: those that are found in one place only.
pub(super) fn found_between(
    from: &Grid<f32>,
    to: &Grid<f32>,
    blocks: &[(usize, usize)],
    reach: Option<isize>,
) -> Vec<(Block, [f64; 2])> {
    let limit = |size: usize| reach.unwrap_or(size as isize / 4).min(size as isize / 4).max(2);
    let reach = (limit(from.columns()), limit(from.rows()));
    let found = |&(left, top): &(usize, usize)| {
        let block = Block::of(from, top, left, SIDE)?;
        let shift = anywhere(&block, to, reach)?;
        Some((block, shift))
    };
    blocks.par_iter().filter_map(found).collect()
}

/// Those that agree on a direction, the direction, and the usual size.
fn agreeing(found: Vec<(Block, [f64; 2])>) -> Option<Moved> {
    let size = |shift: &[f64; 2]| shift[0].hypot(shift[1]);
    let moving = found.iter().filter(|(_, shift)| size(shift) >= MOVES_PX).count();
    let axis = |axis: usize| {
        let moving = found.iter().map(|found| found.1).filter(|shift| size(shift) >= MOVES_PX);
        median(&mut moving.map(|shift| shift[axis]).collect::<Vec<_>>())
    };
    let (x, y) = (axis(0)?, axis(1)?);
    let usual = x.hypot(y);
    if usual < MOVES_PX {
        return None;
    }
    let direction = [x / usual, y / usual];
    let parts = |shift: &[f64; 2]| {
        (shift[0] * direction[0] + shift[1] * direction[1], shift[1] * direction[0] - shift[0] * direction[1])
    };
    let agrees = |shift: &[f64; 2]| {
        let (along, across) = parts(shift);
        along > -MOVES_PX && across.abs() <= 1.0 + 0.1 * along.abs()
    };
    let points: Vec<(Block, f64)> = found
        .into_iter()
        .filter(|(_, shift)| agrees(shift))
        .map(|(block, shift)| (block, parts(&shift).0))
        .collect();
    let agreeing: Vec<f64> = points.iter().map(|point| point.1).filter(|along| *along >= MOVES_PX).collect();
    let moved_px = median(&mut agreeing.clone())?;
    (agreeing.len() >= FEWEST && agreeing.len() as f64 >= AGREE_ON_DIRECTION * moving as f64)
        .then_some((points, direction, moved_px))
}

/// The shift at which a square correlates best, in parts of a pixel, if no other does nearly as well.
fn anywhere(block: &Block, to: &Grid<f32>, (x_reach, y_reach): (isize, isize)) -> Option<[f64; 2]> {
    let all = (-y_reach..=y_reach).flat_map(|y| (-x_reach..=x_reach).map(move |x| (x, y)));
    let tried: Vec<_> = all.filter_map(|(x, y)| Some((block.correlation(to, x, y)?, x, y))).collect();
    let &(best, x, y) = tried.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let is_far =
        |other: &(f32, isize, isize)| (other.1 - x).abs().max((other.2 - y).abs()) as f64 > ONE_PLACE_PX;
    let second = tried.iter().filter(|tried| is_far(tried)).map(|tried| tried.0).fold(0.0, f32::max);
    if best < LEAST_CORRELATION || second > best - AMBIGUOUS {
        return None;
    }
    let beside = |dx, dy| block.correlation(to, x + dx, y + dy);
    Some([
        x as f64 + peak(beside(-1, 0)?, best, beside(1, 0)?),
        y as f64 + peak(beside(0, -1)?, best, beside(0, 1)?),
    ])
}
