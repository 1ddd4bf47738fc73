//! The plane through the votes of a window: disparity and slant, with the sigma of the disparity.

use std::ops::Range;

use super::votes::{VALUE_NOISE_GAIN, Vote};
use super::{Fitted, QUANTISATION_VARIANCE};
use crate::plane::Plane;

/// Surfaces slant by about this much, in px of disparity per px; keeps slants finite in windows that do not show them.
const EXPECTED_SLANT: f64 = 0.1;
/// A pixel of the window belongs to the same surface if its disparity is within this of the window's, in px ...
const SAME_SURFACE_PX: f64 = 1.0;
/// ... and this much more for each pixel that lies between them: steeper surfaces are hardly seen.
const STEEPEST_SLANT: f64 = 0.5;
/// The solution leaves the guesses of its window by no more than this, in px: the linearisation holds within a pixel.
const LONGEST_STEP_PX: f64 = 0.5;
/// Texture must raise the mean squared gradient this far above what noise alone does.
const TEXTURE_OVER_NOISE: f64 = 4.0;

/// A neighbour's vote, placed relative to the fitted pixel.
#[derive(Clone, Copy)]
pub(super) struct Placed {
    u: f64,
    v: f64,
    guess: f64,
    vote: Vote,
}

impl Placed {
    /// Weight times (voted disparity - `centre`).
    fn moment(&self, centre: f64) -> f64 {
        f64::from(self.vote.weight) * (self.guess - centre) + f64::from(self.vote.moment)
    }
}

/// How many times less the votes must scatter about the plane of a shifted window than about that of the centred one for the
/// shifted one to be believed: with some 20 degrees of freedom each, chance exceeds it once in a thousand (F test).
const BENDS: f64 = 4.0;

/// Fits the window around pixel (x, y). Where the surface bends or steps within it, one of the four windows is taken that
/// have the pixel in the middle of a side and lie on one surface.
pub(super) fn window_fit(
    votes: &Plane<Vote>,
    disparity: &Plane<f32>,
    (x, y): (usize, usize),
    side: usize,
    depth_edges: bool,
    window: &mut Vec<Placed>,
) -> Fitted {
    let own = f64::from(disparity.at(x, y));
    if own.is_nan() {
        return Fitted { disparity_px: f32::NAN, sigma_px: f32::NAN };
    }
    // At the borders of the image the window moves inwards instead of shrinking.
    let rows = inside(y, side, votes.rows());
    let columns = inside(x, side, votes.columns());
    gather(votes, disparity, (x, y), (columns.clone(), rows.clone()), window);
    let centre = if depth_edges { own } else { weighted_median(window).unwrap_or(own) };
    // Where the median lies in the window is not known: half the window away in the mean.
    let away =
        |placed: &Placed| if depth_edges { placed.u.abs().max(placed.v.abs()) } else { 0.5 * side as f64 };
    let same_surface =
        |placed: &Placed| (placed.guess - centre).abs() <= SAME_SURFACE_PX + STEEPEST_SLANT * away(placed);
    window.retain(same_surface);
    let mut best = solve(window, centre, side > 1);
    if side > 1 && best.misfit > BENDS {
        let limit = best.misfit / BENDS;
        let reach = side - 1;
        let shifted = [
            (x.saturating_sub(reach)..x + 1, rows.clone()),
            (x..(x + side).min(votes.columns()), rows),
            (columns.clone(), y.saturating_sub(reach)..y + 1),
            (columns, y..(y + side).min(votes.rows())),
        ];
        let mut others = Vec::with_capacity(side * side);
        for area in shifted {
            gather(votes, disparity, (x, y), area, &mut others);
            others.retain(same_surface);
            // Few votes always lie on a plane.
            if 2 * others.len() < side * side {
                continue;
            }
            let solution = solve(&others, centre, true);
            if solution.textured && solution.misfit <= limit && solution.variance() < best.variance() {
                best = solution;
            }
        }
    }
    let sigma = best.variance().sqrt();
    Fitted {
        disparity_px: best.disparity as f32,
        sigma_px: if best.textured && sigma.is_finite() { sigma as f32 } else { f32::NAN },
    }
}

/// Puts the votes of an area into `window`, placed relative to pixel (x, y).
fn gather(
    votes: &Plane<Vote>,
    disparity: &Plane<f32>,
    (x, y): (usize, usize),
    (columns, rows): (Range<usize>, Range<usize>),
    window: &mut Vec<Placed>,
) {
    window.clear();
    for row in rows {
        for column in columns.clone() {
            let vote = votes.at(column, row);
            if vote.freedom > 0.0 {
                window.push(Placed {
                    u: column as f64 - x as f64,
                    v: row as f64 - y as f64,
                    guess: disparity.at(column, row).into(),
                    vote,
                });
            }
        }
    }
}

/// Whether the texture of a grown window lies around the pixel, not beside it: then the answer is no extrapolation.
pub(super) fn surrounds(window: &[Placed], side: usize) -> bool {
    let (mut sum, mut u, mut v) = (0.0, 0.0, 0.0);
    for placed in window {
        let weight = f64::from(placed.vote.weight);
        sum += weight;
        u += weight * placed.u;
        v += weight * placed.v;
    }
    // A quarter of the side: texture on one half of the window only, but up to the pixel, is the limit.
    u.abs().max(v.abs()) <= 0.25 * side as f64 * sum
}

/// `side` indices around `middle`, moved to lie within 0 .. `count` as far as there are so many.
fn inside(middle: usize, side: usize, count: usize) -> Range<usize> {
    let first = middle.saturating_sub(side / 2).min(count.saturating_sub(side));
    first..(first + side).min(count)
}

/// The guess in the middle of the window's guesses, counted by weight: a pixel without texture cannot mislead it.
fn weighted_median(window: &mut [Placed]) -> Option<f64> {
    window.sort_unstable_by(|a, b| a.guess.total_cmp(&b.guess));
    let total: f64 = window.iter().map(|placed| f64::from(placed.vote.weight)).sum();
    let mut sum = 0.0;
    window.iter().find_map(|placed| {
        sum += f64::from(placed.vote.weight);
        (sum >= 0.5 * total).then_some(placed.guess)
    })
}

/// A plane fitted to votes.
#[derive(Debug, Clone, Copy)]
struct Solution {
    disparity: f64,
    /// Variance of the disparity from the residuals along the lines, in px^2.
    noise_variance: f64,
    /// Scatter of the votes about the plane over what that variance lets expect (Birge 1932); at least 1.
    misfit: f64,
    textured: bool,
}

impl Solution {
    fn variance(&self) -> f64 {
        self.noise_variance * self.misfit
    }
}

/// Weighted least squares for the plane through the votes, at the fitted pixel.
fn solve(window: &[Placed], centre: f64, slant: bool) -> Solution {
    // Normal matrix of (d, p, q), upper triangle, and right-hand side.
    let mut normal = [0.0; 6];
    let mut right = [0.0; 3];
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut residual, mut freedom, mut noise_weight, mut count) = (0.0, 0.0, 0.0, 0.0);
    for placed in window {
        let Placed { u, v, vote, .. } = *placed;
        let weight = f64::from(vote.weight);
        let moment = placed.moment(centre);
        for (entry, factor) in normal.iter_mut().zip([1.0, u, v, u * u, u * v, v * v]) {
            *entry += weight * factor;
        }
        for (entry, factor) in right.iter_mut().zip([1.0, u, v]) {
            *entry += moment * factor;
        }
        lowest = lowest.min(placed.guess);
        highest = highest.max(placed.guess);
        residual += f64::from(vote.residual);
        freedom += f64::from(vote.freedom);
        noise_weight += f64::from(vote.noise_weight);
        count += 1.0;
    }
    let variance = (residual / (freedom * VALUE_NOISE_GAIN)).max(QUANTISATION_VARIANCE);
    let [dd, dp, dq, pp, pq, qq] = normal;
    if !(freedom > 0.0 && dd > 0.0) {
        return Solution { disparity: centre, noise_variance: f64::INFINITY, misfit: 1.0, textured: false };
    }
    let (step, p, q, inverse) = if slant {
        // A slant of zero is a weak observation that keeps the system regular.
        let prior = variance / (EXPECTED_SLANT * EXPECTED_SLANT);
        let (pp, qq) = (pp + prior, qq + prior);
        // Cofactors of the symmetric 3 x 3 matrix.
        let minor_dd = pp * qq - pq * pq;
        let minor_dp = dq * pq - dp * qq;
        let minor_dq = dp * pq - dq * pp;
        let determinant = dd * minor_dd + dp * minor_dp + dq * minor_dq;
        let row_p = [minor_dp, dd * qq - dq * dq, dp * dq - dd * pq];
        let row_q = [minor_dq, dp * dq - dd * pq, dd * pp - dp * dp];
        let dot = |row: [f64; 3]| (row[0] * right[0] + row[1] * right[1] + row[2] * right[2]) / determinant;
        (dot([minor_dd, minor_dp, minor_dq]), dot(row_p), dot(row_q), minor_dd / determinant)
    } else {
        (right[0] / dd, 0.0, 0.0, 1.0 / dd)
    };

    let scatter: f64 = window
        .iter()
        .filter(|placed| placed.vote.weight > 0.0)
        .map(|placed| {
            let weight = f64::from(placed.vote.weight);
            let error = placed.moment(centre) / weight - step - p * placed.u - q * placed.v;
            weight * error * error
        })
        .sum();
    let spare = count - if slant { 3.0 } else { 1.0 };
    let misfit = if spare >= 1.0 { (scatter / (variance * spare)).max(1.0) } else { 1.0 };
    Solution {
        disparity: (centre + step).clamp(lowest - LONGEST_STEP_PX, highest + LONGEST_STEP_PX),
        noise_variance: variance * inverse,
        misfit,
        textured: dd > TEXTURE_OVER_NOISE * variance * noise_weight,
    }
}
