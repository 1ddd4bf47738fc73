//! The last digits of the disparity, and its sigma: a fit of the line over all frames that see it.
//!
//! Model: the intensities of a window are one template, unknown, moving along the line; the disparity varies linearly over
//! the window (slant). Around a first guess d0 of each pixel, its samples are I_t = T + g (d0 - d) tau'_t + noise, where g
//! is the template's gradient along x, the mean of the frames' gradients along the line, and tau' = tau - tau_r. The
//! regression of I on tau' has the slope b = g (d0 - d). Each pixel thus votes for d = d0 - b / g with the weight
//! w = g^2 S, S = sum of (tau' - mean)^2, and the least-squares solution of all pixels of the window is the plane
//! d + p u + q v fitted to their votes: a Gauss-Newton step of the joint problem, template eliminated. Steps are repeated
//! from the new disparities.
//!
//! For noise s the covariance of the solution is s^2 times the inverse of the normal matrix, which for one pixel or an
//! upright window is the Cramer-Rao bound var(d) = s^2 / (sum of w) (equidistant frames: 12 s^2 / (N sum of g^2)).

use rayon::prelude::*;

use super::interpolation::{Interpolation, SampledEpi, TAPS};
use super::lines::{Lines, SeenRule};
use super::options::HiddenPoints;
use crate::plane::Plane;
use crate::volume::Volume;

/// Quantisation alone leaves a noise of this variance, in DN^2 (uniform over one DN).
const QUANTISATION_VARIANCE: f64 = 1.0 / 12.0;
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
/// Variance of the value of a cubic B-spline through white noise, over that of the noise, mean over the positions between
/// pixels: 1 at a pixel, 0.76 halfway (the squared response of weights and prefilter, integrated; see the tests).
const VALUE_NOISE_GAIN: f64 = 0.874;
/// The same for its derivative, per px^2: 1.39 at a pixel, 3.42 halfway.
const GRADIENT_NOISE_GAIN: f64 = 2.475;

/// One pixel's share in the fits of the windows that contain it.
#[derive(Debug, Clone, Copy)]
struct Vote {
    /// g^2 S, the weight in the fit.
    weight: f32,
    /// Weight times (voted disparity - d0).
    moment: f32,
    /// Sum of squared residuals of the regression, in DN^2.
    residual: f32,
    /// Degrees of freedom of that sum.
    freedom: f32,
    /// What the weight would be on average without texture, over the noise variance.
    noise_weight: f32,
}

const NO_VOTE: Vote = Vote { weight: 0.0, moment: 0.0, residual: 0.0, freedom: 0.0, noise_weight: 0.0 };

/// How the fit is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Side of the window, in px, odd.
    pub window_px: usize,
    /// Where the window leaves a larger sigma than this, in px, it grows in the last step as long as it has to ...
    pub wanted_sigma_px: f64,
    /// ... and as far as this side, in px, odd.
    pub largest_window_px: usize,
    /// Gauss-Newton steps; 0 leaves the disparity and only states its sigma.
    pub steps: usize,
    /// Which frames count.
    pub rule: SeenRule,
    /// Whether neighbours may lie on other surfaces: then only those near the pixel's own disparity vote.
    pub depth_edges: bool,
}

/// A fitted pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitted {
    /// Disparity in px.
    pub disparity_px: f32,
    /// Its standard deviation in px; NaN where noise alone explains the gradients.
    pub sigma_px: f32,
}

/// Fits every pixel whose guess is a number; the others stay NaN. `report` is called once for each row and step.
pub fn fit(
    volume: &Volume,
    lines: &Lines,
    guess: &Plane<f32>,
    options: Fit,
    report: impl Fn() + Sync,
) -> Plane<Fitted> {
    let (rows, columns) = (guess.rows(), guess.columns());
    let mut disparity = guess.clone();
    let mut fitted = Plane::filled(rows, columns, Fitted { disparity_px: f32::NAN, sigma_px: f32::NAN });
    let passes = options.steps.max(1);
    for pass in 1..=passes {
        let mut votes = Plane::filled(rows, columns, NO_VOTE);
        votes.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
            let epi = SampledEpi::new(volume, y, Interpolation::BSpline, 0);
            for (x, vote) in out.iter_mut().enumerate() {
                *vote = pixel_vote(&epi, lines, x, disparity.at(x, y).into(), options.rule);
            }
            report();
        });
        fitted.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
            let mut window = Vec::with_capacity(options.window_px * options.window_px);
            for (x, value) in out.iter_mut().enumerate() {
                let mut side = options.window_px;
                *value = window_fit(&votes, &disparity, (x, y), side, options.depth_edges, &mut window);
                // A NaN is no sigma that anyone wants.
                let wanted = |value: &Fitted| f64::from(value.sigma_px) <= options.wanted_sigma_px;
                let last_step = pass == passes && !disparity.at(x, y).is_nan();
                while last_step && !wanted(value) && side < options.largest_window_px {
                    side = (2 * side + 1).min(options.largest_window_px);
                    *value = window_fit(&votes, &disparity, (x, y), side, options.depth_edges, &mut window);
                    if !surrounds(&window, side) {
                        value.sigma_px = f32::NAN;
                    }
                }
            }
        });
        if pass < passes {
            disparity = fitted.map(|value| value.disparity_px);
        }
    }
    if options.steps == 0 {
        for (value, &guess) in fitted.values_mut().iter_mut().zip(guess.values()) {
            // What the fit would have moved it by is a part of its error.
            value.sigma_px = value.sigma_px.hypot(value.disparity_px - guess);
            value.disparity_px = guess;
        }
    }
    fitted
}

/// Sums over the frames that see one pixel's line.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: f64,
    tau: f64,
    tau_tau: f64,
    value: f64,
    value_tau: f64,
    value_value: f64,
    slope: f64,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, tau: f64, value: f64, slope: f64) {
        self.count += 1.0;
        self.tau += tau;
        self.tau_tau += tau * tau;
        self.value += value;
        self.value_tau += value * tau;
        self.value_value += value * value;
        self.slope += slope;
    }

    fn joined(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            tau: self.tau + other.tau,
            tau_tau: self.tau_tau + other.tau_tau,
            value: self.value + other.value,
            value_tau: self.value_tau + other.value_tau,
            value_value: self.value_value + other.value_value,
            slope: self.slope + other.slope,
        }
    }

    fn vote(self) -> Vote {
        let spread = self.tau_tau - self.tau * self.tau / self.count;
        if self.count < 3.0 || spread <= 0.0 {
            return NO_VOTE;
        }
        let covariance = self.value_tau - self.value * self.tau / self.count;
        let gradient = self.slope / self.count;
        let energy = self.value_value - self.value * self.value / self.count;
        Vote {
            weight: (gradient * gradient * spread) as f32,
            moment: (-gradient * covariance) as f32,
            residual: (energy - covariance * covariance / spread).max(0.0) as f32,
            freedom: (self.count - 2.0) as f32,
            noise_weight: (GRADIENT_NOISE_GAIN / self.count * spread) as f32,
        }
    }

    fn residual_variance(self) -> f64 {
        let vote = self.vote();
        if vote.freedom > 0.0 { f64::from(vote.residual / vote.freedom) } else { f64::INFINITY }
    }
}

fn pixel_vote(epi: &SampledEpi, lines: &Lines, x: usize, disparity: f64, rule: SeenRule) -> Vote {
    if disparity.is_nan() {
        return NO_VOTE;
    }
    let reference = lines.reference();
    let (anchor, anchor_slope) = sample(epi.taps(reference, x as isize, 1), 0.0);
    // The spline is mirrored at the borders, so within a pixel of them its slope is not that of the scene.
    let sound = |position: f64| position >= 1.0 && position <= (lines.columns() - 2) as f64;
    let mut sides = [Sums::default(); 2];
    for (t, &tau) in lines.offsets().iter().enumerate() {
        let position = x as f64 + disparity * tau;
        if t == reference || !sound(position) {
            continue;
        }
        let whole = position.floor();
        let (value, slope) = sample(epi.taps(t, whole as isize, 1), (position - whole) as f32);
        sides[usize::from(t > reference)].add(tau, f64::from(value - anchor), slope.into());
    }
    let mut own = Sums::default();
    if sound(x as f64) {
        own.add(0.0, 0.0, anchor_slope.into());
    }
    let [before, after] = sides;
    let all = before.joined(after).joined(own);
    let mut best = all;
    if rule.hidden_points == HiddenPoints::OneSide {
        // A side that fits far better than all frames together says that the point is hidden on the other one: twice the
        // residual variance is beyond chance for some ten frames.
        for side in [before.joined(own), after.joined(own)] {
            let clearly_better =
                2.0 * side.residual_variance() + QUANTISATION_VARIANCE < best.residual_variance();
            if rule.suffices(side.count as usize) && clearly_better {
                best = side;
            }
        }
    }
    if rule.suffices(best.count as usize) { best.vote() } else { NO_VOTE }
}

#[inline(always)]
fn sample(taps: &[f32], fraction: f32) -> (f32, f32) {
    let values = Interpolation::bspline_weights(fraction);
    let slopes = Interpolation::bspline_slope_weights(fraction);
    let taps: &[f32; TAPS] = taps.first_chunk().unwrap_or(&[0.0; TAPS]);
    let dot = |weights: [f32; TAPS]| {
        weights[0] * taps[0] + weights[1] * taps[1] + weights[2] * taps[2] + weights[3] * taps[3]
    };
    (dot(values), dot(slopes))
}

/// A neighbour's vote, placed relative to the fitted pixel.
#[derive(Clone, Copy)]
struct Placed {
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

fn window_fit(
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
    let centre = if depth_edges { own } else { weighted_median(window).unwrap_or(own) };
    // Where the median lies in the window is not known: half the window away in the mean.
    let away =
        |placed: &Placed| if depth_edges { placed.u.abs().max(placed.v.abs()) } else { 0.5 * side as f64 };
    window.retain(|placed| (placed.guess - centre).abs() <= SAME_SURFACE_PX + STEEPEST_SLANT * away(placed));
    let best = solve(window, centre, side > 1);
    let sigma = best.variance().sqrt();
    Fitted {
        disparity_px: best.disparity as f32,
        sigma_px: if best.textured && sigma.is_finite() { sigma as f32 } else { f32::NAN },
    }
}

/// Whether the texture of a grown window lies around the pixel, not beside it: then the answer is no extrapolation.
fn surrounds(window: &[Placed], side: usize) -> bool {
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
fn inside(middle: usize, side: usize, count: usize) -> std::ops::Range<usize> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean over the positions between pixels of the squared frequency response of `weights` and the prefilter, integrated
    /// over the frequencies: the variance that white noise is left with.
    fn noise_gain(weights: fn(f32) -> [f32; TAPS]) -> f64 {
        let (steps, fractions) = (2000, 200);
        let mut sum = 0.0;
        for index in 0..fractions {
            let weights = weights((index as f32 + 0.5) / fractions as f32);
            for step in 0..steps {
                let omega = std::f64::consts::TAU * (f64::from(step) + 0.5) / f64::from(steps);
                let (mut real, mut imaginary) = (0.0, 0.0);
                for (tap, weight) in weights.iter().enumerate() {
                    real += f64::from(*weight) * (omega * tap as f64).cos();
                    imaginary += f64::from(*weight) * (omega * tap as f64).sin();
                }
                let prefilter = 6.0 / (4.0 + 2.0 * omega.cos());
                sum += (real * real + imaginary * imaginary) * prefilter * prefilter;
            }
        }
        sum / (f64::from(steps) * f64::from(fractions))
    }

    #[test]
    fn noise_gains_are_those_of_the_frequency_response() {
        assert!((noise_gain(Interpolation::bspline_weights) - VALUE_NOISE_GAIN).abs() < 0.001);
        assert!((noise_gain(Interpolation::bspline_slope_weights) - GRADIENT_NOISE_GAIN).abs() < 0.002);
    }
}
