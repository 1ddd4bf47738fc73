//! What supports smooth away, and what of it is told by whom.
//!
//! A step that is small against the noise of single observations is not seen by the window that it crosses, which then errs without knowing. Three witnesses tell:
//!
//! - *Small windows*, many together: where supports smooth something away, they differ from windows of 3 x 3 and of 5 x 5 px by more than the small ones' noise
//!   explains.
//! - *Windows that disagree*: of those that competed for a pixel, credible ones lie off the best one by more than chance lets them. As either may be wrong, half of
//!   the mean square is the best one's.
//! - *The surface itself*, at steps that it sees: it cannot tell where between two pixels a step lies.
//!
//! The first two are pooled over many pixels, see [`pools`]; a single pixel's windows tell on their own only where they disagree far beyond chance.

mod pools;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use super::padded::{PAD, Padded};
use super::planes::SurfacePlanes;
use super::support::APART_BY_CHANCE;
use pools::{Excess, pooled};

/// A small window this far away has not seen what is smoothed away, but another surface, in px.
const ANOTHER_SURFACE_PX: f64 = 0.5;
/// Small windows tell only where supports have at least this share of their variance to spare.
pub(super) const LEAST_SPARE: f64 = 0.2;
/// What competing windows disagree by is alike within as many pixels along a row or a column: half the length of long windows.
const ALIKE_PX: usize = 9;
/// A pixel's own windows disagree beyond chance if they do so this many times as far as on a plane, in the mean square; there one in seventy does.
const FAR_APART: f32 = 4.0;
/// Slants beside a step are those of pixels this far away, in px, whose long windows it does not cross.
const BESIDE_PX: usize = 3;
/// Steps stand out of noise if they are this many of their standard deviations.
const STEP_SIGMAS: f32 = 2.0;
/// Larger steps are edges of things, in px; the search has decided to which side pixels belong.
const LARGEST_STEP_PX: f32 = 1.0;

/// What the windows that competed for the planes of `map` disagreed by beyond chance, as variances in px^2; NaN where pools tell nothing.
pub(super) fn disagreement(map: &SurfacePlanes) -> Padded {
    pooled(map, ALIKE_PX, |place, y| disagreement_at(map, place, y))
}

/// The variances, in px^2, of what `surface` smooths away, by what the windows disagreed by that competed for the planes of `map`, in `pools` and on their own, and at its own
/// steps. Nothing at `creases`, places of the padded row for each row: there the faces tell.
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
        // Beside a crease that the faces tell, what rises is no step, and windows that disagree are those that straddle.
        creases.get(y).into_iter().flatten().for_each(|&place| smoothed[place] = 0.0);
    });
    smoothed
}

/// The same by small windows of `side` px, whose planes are `small`, where supports have the share `least_spare` of their variance to spare; NaN where they do not tell.
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

/// What one kind of small windows tells, as a variance to be added; nothing where it does not.
pub(super) fn told(mut missed: Padded) -> Padded {
    missed.par_rows().for_each(|missed| missed.iter_mut().for_each(|missed| *missed = missed.max(0.0)));
    missed
}

/// The lesser of what two kinds of small windows tell, or what one of them does: what they themselves err by beyond their noise counts as if it were smoothed away,
/// so each tells at most. Nothing where neither does.
pub(super) fn told_by_both(mut missed: Padded, other: &Padded) -> Padded {
    missed.par_rows().enumerate().for_each(|(y, missed)| {
        // NaN is the lesser of nothing.
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

/// The variance, in px^2, of a pixel between two whose disparities differ by `rise`, with this variance: what the slant of neither side explains is a step. It lies
/// anywhere between the two, which makes a twelfth of its square, as for anything uniformly distributed.
fn step(rise: f32, noise: f32, slants: [f32; 2]) -> f32 {
    let [left, right] = slants.map(|slant| (rise - 2.0 * slant).abs());
    let step = left.min(right);
    let seen = step > STEP_SIGMAS * noise.sqrt() && step < LARGEST_STEP_PX;
    if seen { step * step / 12.0 } else { 0.0 }
}
