//! Relief that supports smooth away, as a part of sigma.
//!
//! A step that is small against the noise of single observations is not seen by a window that it crosses, so
//! the plane errs and its covariance does not say so. Three other sources tell:
//!
//! - *Small windows*, many together: where supports smooth something away, they differ from windows of 3 x 3
//!   and of 5 x 5 px by more than the noise of the small ones.
//! - *Disagreement of windows*: credible windows that competed for a pixel lie off the best one by more than
//!   chance. As either may be wrong, half of the mean square is the best one's.
//! - *The surface itself*, at the steps that it shows: where between two pixels a step lies is not known.
//!
//! The first two are pooled over many pixels, see [`pools`]. A single pixel's windows count on their own only
//! where they disagree far beyond chance.

mod pools;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use super::padded::{PAD, Padded};
use super::planes::SurfacePlanes;
use super::support::APART_BY_CHANCE;
use pools::{Excess, pooled};

/// A small window whose plane is this far away, in px, has seen another surface.
const ANOTHER_SURFACE_PX: f64 = 0.5;
/// Small windows tell only where supports have at least this share of their variance to spare.
pub(super) const LEAST_SPARE: f64 = 0.2;
/// Disagreement of competing windows is alike within this many pixels along a row or a column: half the
/// length of long windows.
const ALIKE_PX: usize = 9;
/// A pixel's own windows disagree beyond chance if they do so this many times as far as on a plane, in the
/// mean square; there one in seventy does.
const FAR_APART: f32 = 4.0;
/// Slants beside a step are those of pixels this far away, in px, whose long windows it does not cross.
const BESIDE_PX: usize = 3;
/// Steps are significant if they are this many of their standard deviations.
const STEP_SIGMAS: f32 = 2.0;
/// Larger steps are edges of things, in px; the search has decided to which side pixels belong.
const LARGEST_STEP_PX: f32 = 1.0;

/// Disagreement, beyond chance, of the windows that competed for the planes of `map`, as variances in px^2;
/// NaN where pools show nothing.
pub(super) fn disagreement(map: &SurfacePlanes) -> Padded {
    pooled(map, ALIKE_PX, |place, y| disagreement_at(map, place, y))
}

/// The variances, in px^2, of what `surface` smooths away: from the disagreement of the windows that competed
/// for the planes of `map`, in `pools` and on their own, and from the surface's own steps. Zero at `creases`
/// (places of the padded row for each row), where the faces decide.
pub(super) fn smoothed_away(
    (surface, creases): (&SurfacePlanes, &[Vec<usize>]),
    map: &SurfacePlanes,
    pools: Padded,
) -> Padded {
    let mut smoothed = pools;
    smoothed.par_rows().enumerate().for_each(|(y, smoothed)| {
        let (apart, variance) = (map.texture.row(y), map.variance.row(y));
        for (place, smoothed) in smoothed.iter_mut().enumerate() {
            // NaN where pools tell nothing.
            let pooled = smoothed.max(0.0);
            let far = apart[place] > FAR_APART * APART_BY_CHANCE * variance[place];
            *smoothed = if far { pooled.max(apart[place]) } else { pooled } / 2.0;
        }
        add_steps(smoothed, surface, map, y);
        // Beside a crease, a rise is no step, and windows that disagree are those that straddle it.
        creases.get(y).into_iter().flatten().for_each(|&place| smoothed[place] = 0.0);
    });
    smoothed
}

/// The same by small windows of `side` px, whose planes are `small`, where supports have the share
/// `least_spare` of their variance to spare; NaN where they do not tell.
pub(super) fn missed_by_small(
    surface: &SurfacePlanes,
    (small, side): (&SurfacePlanes, usize),
    least_spare: f64,
) -> Padded {
    pooled(surface, side, |place, y| {
        let noise = f64::from(small.variance.row(y)[place]);
        let spare = noise - f64::from(surface.variance.row(y)[place]);
        let difference = f64::from(small.disparity.row(y)[place] - surface.disparity.row(y)[place]);
        if spare > least_spare * noise && spare.is_finite() && difference.abs() <= ANOTHER_SURFACE_PX {
            // The square of a Gaussian has twice its squared variance for variance.
            Excess::new(difference * difference - spare, 2.0 * spare * spare)
        } else {
            Excess::default()
        }
    })
}

/// The variance that one kind of small windows shows, to be added; zero where it shows none.
pub(super) fn own_variance(mut missed: Padded) -> Padded {
    missed.par_rows().for_each(|missed| missed.iter_mut().for_each(|missed| *missed = missed.max(0.0)));
    missed
}

/// The lesser of the variances that two kinds of small windows show, or that of the only one. The errors of
/// small windows beyond their noise count as if they were smoothed away, so each variance is an upper bound.
/// Zero where neither shows any.
pub(super) fn common_variance(mut missed: Padded, other: &Padded) -> Padded {
    missed.par_rows().enumerate().for_each(|(y, missed)| {
        // The lesser of NaN and a number is the number.
        missed.iter_mut().zip(other.row(y)).for_each(|(missed, other)| *missed = missed.min(*other).max(0.0));
    });
    missed
}

/// How much more the windows disagreed that competed for a pixel than on a plane.
fn disagreement_at(map: &SurfacePlanes, place: usize, y: usize) -> Excess {
    let by_chance = f64::from(APART_BY_CHANCE * map.variance.row(y)[place]);
    if by_chance > 0.0 && by_chance.is_finite() {
        // A few windows make one pixel's mean square; it varies by about as much as it is.
        Excess::new(f64::from(map.texture.row(y)[place]) - by_chance, by_chance * by_chance)
    } else {
        Excess::default()
    }
}

/// Adds the uncertainty of where steps lie to row `y`.
fn add_steps(smoothed: &mut [f32], surface: &SurfacePlanes, map: &SurfacePlanes, y: usize) {
    let (disparity, variance) = (surface.disparity.row(y), surface.variance.row(y));
    let slant = map.slant_x.row(y);
    for place in PAD..smoothed.len() - PAD {
        let rise = disparity[place + 1] - disparity[place - 1];
        let noise = variance[place - 1] + variance[place + 1];
        smoothed[place] += step(rise, noise, [slant[place - BESIDE_PX], slant[place + BESIDE_PX]]);
    }
    if y == 0 || y + 1 == surface.rows() {
        return;
    }
    let [before, after] = [y - 1, y + 1].map(|y| (surface.disparity.row(y), surface.variance.row(y)));
    let slants = [y.saturating_sub(BESIDE_PX), (y + BESIDE_PX).min(surface.rows() - 1)];
    let slants = slants.map(|y| map.slant_y.row(y));
    for place in PAD..smoothed.len() - PAD {
        let (rise, noise) = (after.0[place] - before.0[place], before.1[place] + after.1[place]);
        smoothed[place] += step(rise, noise, slants.map(|slant| slant[place]));
    }
}

/// The variance, in px^2, of a pixel between two whose disparities differ by `rise`, with this variance. The
/// part that neither side's slant explains is a step. It lies anywhere between the two pixels, which gives a
/// twelfth of its square (uniform distribution).
fn step(rise: f32, noise: f32, slants: [f32; 2]) -> f32 {
    let [left, right] = slants.map(|slant| (rise - 2.0 * slant).abs());
    let step = left.min(right);
    let seen = step > STEP_SIGMAS * noise.sqrt() && step < LARGEST_STEP_PX;
    if seen { step * step / 12.0 } else { 0.0 }
}
