//! Pixel locking, measured along the lines of some thousand points, and the bias that it gives to each
//! disparity.
//!
//! Texture of frequency omega, sampled at whole pixels and interpolated at the fraction f, comes back as
//! H_0 + sum of H_h exp(-2 pi i h f), where the H_h are the shares of its aliases (of a spline: (omega - 2 pi
//! h)^-6 over their sum; Unser 1999). So with e_t = exp(-2 pi i h f_t) the values along a point's line are
//! T + Re(C e_t), and the gradients g_0 + Re(D e_t). The fit regresses the values on tau', weighted by the mean
//! gradient g = g_0 + Re(D u), u = mean of e_t. With m, the slope of e_t over tau', the disparities of many
//! points err on average by
//!
//! -(alpha Im(-m) - kappa / 2 Im(u conj(m))) / (G + 2 gamma Re(u) + Q |u|^2 / 2),
//!
//! G = mean of g_0^2, alpha = that of g_0 Im(C), kappa = that of Im(D conj(C)), gamma = that of g_0 Re(D),
//! Q = that of |D|^2. The other means vanish for texture that looks alike from left and right.
//!
//! alpha is what interpolation takes from texture near two pixels per period. kappa is finer texture, which
//! the sensor shows as a coarser one that moves the wrong way. All of them are measured where fractions are
//! well spread, and predict the bias where they are not. If fractions are well spread nowhere, kappa stays
//! unknown and the bias is mostly overstated. alpha still shows in a single frame: halfway between pixels the
//! variance is less by the sum of 4 H_0 H_1 P, and H_0 H_1 leaves little but omega = pi.

mod prediction;
mod products;
#[cfg(test)]
mod tests;

use std::f64::consts::PI;
use std::ops::Range;

pub(super) use prediction::{Amplitudes, Prediction};
pub(super) use products::Turns;
use products::{Normal, Products, TERMS, Terms, fraction};

use super::spline::{FRACTIONS, Spline, SplineEpi, TAPS};
use crate::lines::EpiLines;
use crate::validity::visibility::seen_interval;

/// Rows that are looked at, spread over the image.
const SAMPLED_ROWS: usize = 32;
/// Only every n-th column is used: nearer ones show the same texture.
const COLUMN_STEP: usize = 4;
/// Points whose residuals vary by more than this many times those of a good one of their row, the lower
/// quartile (in squares), count as much less.
const ACCEPTED: f64 = 6.0;
/// Fractions are well spread if a harmonic is known with at most this many times the variance that evenly
/// spread ones leave.
const WELL_SPREAD: f64 = 1.25;
/// At least so many points of a row, or its sums are too uncertain.
const LEAST_POINTS: usize = 8;
/// With fewer frames, this many terms cannot be separated from chance.
const LEAST_FRAMES: usize = 2 * TERMS;
/// Columns before a point from which coefficients are taken, so that all that a sample's square is made of
/// lie behind.
const BESIDE: isize = 4;
/// A frame moved by a whole number of pixels but for this many steps of the table shows texture as the
/// reference frame does.
const NEARLY_WHOLE: usize = FRACTIONS / 8;

/// Whether row `y` of `rows` is looked at.
pub(super) fn is_sampled(y: usize, rows: usize) -> bool {
    let sampled = rows.min(SAMPLED_ROWS);
    (y + 1) * sampled / rows > y * sampled / rows
}

/// One frame of a line.
#[derive(Debug, Clone, Copy)]
struct Sighting {
    frame: usize,
    tau: f64,
    /// Column of the sample, rounded down, and the rest of its place, in steps of the table.
    column: isize,
    fraction: usize,
}

/// Sums over the points of one row.
pub(super) struct RowSums {
    /// By lines whose fractions are well spread.
    lines: Option<LineSums>,
    /// By their texture, of which nothing but alpha is known.
    texture: Option<Products>,
}

/// Sums over the lines of one row.
struct LineSums {
    products: Products,
    /// For each frame the sums of gradient times residual, and of gradient squared.
    frames: Vec<(f64, f64)>,
}

/// A line that has been sampled.
struct Point {
    sightings: Vec<Sighting>,
    residuals: Vec<f64>,
    products: Products,
    gradient: f64,
    /// Variance of the residuals.
    spread: f64,
}

/// Which lines of a row are looked at.
#[derive(Clone, Copy)]
pub(super) struct RowLines<'a> {
    pub(super) lines: &'a EpiLines,
    /// Disparities in px, NaN where unknown.
    pub(super) disparities: &'a [f32],
    /// The columns that frames show.
    pub(super) columns: &'a Range<usize>,
    /// First and last tau' in which each pixel is seen; `None`: wherever it is in these columns.
    pub(super) visible: Option<&'a [(f32, f32)]>,
    /// A point seen in fewer frames does not count.
    pub(super) minimum_frames: usize,
}

impl RowLines<'_> {
    /// First and last tau' in which the point at `x` is seen.
    fn seen(&self, x: usize, disparity: f64) -> (f64, f64) {
        let visible = self.visible.map(|visible| visible[x]);
        let (first, last) = seen_interval(x as f64, disparity, self.columns, visible);
        (first.max(-self.lines.tau_before()), last.min(self.lines.tau_after()))
    }

    /// The frames that see the point at `x`.
    fn sightings(&self, x: usize, disparity: f64) -> Vec<Sighting> {
        let (first, last) = self.seen(x, disparity);
        let frames = self.lines.offsets().iter().enumerate();
        let seen = frames.filter(|&(_, &tau)| tau >= first && tau <= last);
        seen.map(|(frame, &tau)| {
            let steps = (disparity * tau * FRACTIONS as f64).round() as isize;
            let column = x as isize + steps.div_euclid(FRACTIONS as isize);
            Sighting { frame, tau, column, fraction: fraction(disparity * tau) }
        })
        .collect()
    }

    fn point(&self, spline: &Spline, turns: &Turns, epi: &SplineEpi, x: usize) -> Option<Point> {
        let disparity = f64::from(self.disparities[x]);
        if disparity.is_nan() {
            return None;
        }
        let sightings = self.sightings(x, disparity);
        let count = sightings.len();
        if count < self.minimum_frames.max(LEAST_FRAMES) {
            return None;
        }
        let mut normal = Normal::zeros();
        for sighting in &sightings {
            let terms = turns.terms(sighting.tau, sighting.fraction);
            normal += terms * terms.transpose();
        }
        let inverse = normal.cholesky()?.inverse();
        let even = 2.0 / count as f64;
        if (2..TERMS).any(|term| inverse[(term, term)] > WELL_SPREAD * even) {
            return None;
        }
        let (mut values, mut gradients) = (Terms::zeros(), Terms::zeros());
        let mut residuals = Vec::with_capacity(count);
        for sighting in &sightings {
            let taps = epi.taps(sighting.frame, sighting.column);
            let [value, gradient, _] = spline.weights(sighting.fraction);
            let dot =
                |weights: &[f32]| weights.iter().zip(taps).map(|(weight, tap)| weight * tap).sum::<f32>();
            let (value, gradient) = (f64::from(dot(value)), f64::from(dot(gradient)));
            let terms = turns.terms(sighting.tau, sighting.fraction);
            values += terms * value;
            gradients += terms * gradient;
            residuals.push(value);
        }
        (values, gradients) = (inverse * values, inverse * gradients);
        for (residual, sighting) in residuals.iter_mut().zip(&sightings) {
            *residual -= values.dot(&turns.terms(sighting.tau, sighting.fraction));
        }
        let spread = residuals.iter().map(|residual| residual * residual).sum::<f64>();
        let products = Products::of(&values, &gradients, 1.0);
        Some(Point { sightings, residuals, products, gradient: gradients[0], spread })
    }

    /// Sums over the row's points.
    pub(super) fn sums(&self, spline: &Spline, turns: &Turns, epi: &SplineEpi) -> RowSums {
        RowSums { lines: self.line_sums(spline, turns, epi), texture: self.texture_sums(spline, epi) }
    }

    fn line_sums(&self, spline: &Spline, turns: &Turns, epi: &SplineEpi) -> Option<LineSums> {
        let columns = (COLUMN_STEP / 2..self.lines.columns()).step_by(COLUMN_STEP);
        let points: Vec<Point> = columns.filter_map(|x| self.point(spline, turns, epi, x)).collect();
        if points.len() < LEAST_POINTS {
            return None;
        }
        let mut spreads: Vec<f64> = points.iter().map(|point| point.spread).collect();
        let quartile = spreads.len() / 4;
        let limit = ACCEPTED * *spreads.select_nth_unstable_by(quartile, f64::total_cmp).1;
        let frames = vec![(0.0, 0.0); self.lines.frames()];
        let mut sums = LineSums { products: Products::default(), frames };
        for point in points {
            let weight = if point.spread > limit { limit / point.spread } else { 1.0 };
            sums.products.add(&point.products, weight);
            for (sighting, residual) in point.sightings.iter().zip(&point.residuals) {
                let frame = &mut sums.frames[sighting.frame];
                frame.0 += weight * point.gradient * residual;
                frame.1 += weight * point.gradient * point.gradient;
            }
        }
        Some(sums)
    }

    /// alpha from the texture of the row's points: products of two frames, whose noise is independent.
    fn texture_sums(&self, spline: &Spline, epi: &SplineEpi) -> Option<Products> {
        let reference = self.lines.reference();
        let mut pairs = Vec::new();
        for x in (COLUMN_STEP / 2..self.lines.columns()).step_by(COLUMN_STEP) {
            let sightings = self.sightings(x, f64::from(self.disparities[x]));
            let from_whole = |sighting: &Sighting| sighting.fraction.min(FRACTIONS - sighting.fraction);
            let others = sightings.iter().filter(|other| other.frame != reference);
            let partner = others.min_by_key(|other| (from_whole(other), other.frame.abs_diff(reference)));
            if let Some(partner) = partner.filter(|partner| from_whole(partner) <= NEARLY_WHOLE) {
                let whole = partner.column + isize::from(partner.fraction > FRACTIONS / 2);
                pairs.push((
                    epi.taps(reference, x as isize - BESIDE),
                    epi.taps(partner.frame, whole - BESIDE),
                ));
            }
        }
        if pairs.len() < LEAST_POINTS {
            return None;
        }
        // The loss of variance at half a pixel, as a sum over coefficients: low frequencies cancel.
        let [own, half] = [0, FRACTIONS / 2].map(|fraction| spline.weights(fraction)[0]);
        let correlation = |weights: &[f32; TAPS], lag: usize| {
            weights.iter().zip(&weights[lag..]).map(|(one, other)| f64::from(one * other)).sum::<f64>()
        };
        let kernel: [f64; TAPS] = std::array::from_fn(|lag| correlation(&own, lag) - correlation(&half, lag));
        let gradient = &spline.weights(0)[1];
        let (mut lost, mut square) = (0.0, 0.0);
        for (one, other) in pairs {
            let middle = f64::from(one[TAPS]);
            let lags = (1..TAPS).map(|lag| kernel[lag] * f64::from(other[TAPS - lag] + other[TAPS + lag]));
            lost += middle * (kernel[0] * f64::from(other[TAPS]) + lags.sum::<f64>());
            let gradient = |taps: &[f32]| {
                gradient.iter().zip(taps).map(|(weight, tap)| f64::from(weight * tap)).sum::<f64>()
            };
            square += gradient(one) * gradient(other);
        }
        let mut products = Products { square, ..Products::default() };
        products.harmonics[0][0] = -PI / 4.0 * lost;
        Some(products)
    }
}
