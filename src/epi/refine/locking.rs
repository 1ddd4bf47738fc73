//! How far pixels lock, measured at the lines of some thousand points, and what that does to each disparity.
//!
//! Texture of frequency omega, sampled at whole pixels and interpolated at the fraction f, comes back as H_0 + sum of H_h exp(-2 pi i h f), where the
//! H_h are the shares of its aliases (of a spline: (omega - 2 pi h)^-6 over their sum; Unser 1999). So with e_t = exp(-2 pi i h f_t) the values along a
//! point's line are T + Re(C e_t), and the gradients g_0 + Re(D e_t). The fit regresses the values on tau', with the mean gradient g = g_0 + Re(D u),
//! u = mean of e_t, for weight. With m, the slope of e_t over tau', the disparities of many points err on average by
//!
//!   -(alpha Im(-m) - kappa / 2 Im(u conj(m))) / (G + 2 gamma Re(u) + Q |u|^2 / 2),
//!
//! G = mean of g_0^2, alpha = that of g_0 Im(C), kappa = that of Im(D conj(C)), gamma = that of g_0 Re(D), Q = that of |D|^2; the other means vanish for
//! texture that looks alike from left and right. alpha is what interpolation takes from texture near two pixels per period, kappa is finer texture,
//! which the sensor shows as a coarser one that moves the wrong way. All of them are measured where fractions are well spread, and
//! tell what happens where they are not. Where they are well spread nowhere, kappa stays unknown, but alpha shows in a single frame: half a pixel beside
//! the pixels the variance is less by the sum of 4 H_0 H_1 P, and H_0 H_1 leaves little but omega = pi. Without kappa the bias is mostly overstated.

use std::f64::consts::{PI, TAU as TURN};

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::spline::{FRACTIONS, Spline, SplineEpi};
use crate::epi::lines::Lines;
use crate::epi::locking::{LOCKING_HARMONICS, LockingAmplitudes, LockingHarmonic};

/// Rows that are looked at, spread over the image.
const SAMPLED_ROWS: usize = 32;
/// Every so manieth column is: nearer ones show the same texture.
const COLUMN_STEP: usize = 4;
/// Points whose residuals vary by more than this many times those of a good one of their row, the lower quartile (in squares), count as much less.
const BELIEVED: f64 = 6.0;
/// Fractions are well spread if a harmonic is known with at most this many times the variance that evenly spread ones leave.
const WELL_SPREAD: f64 = 2.0;
/// Rows and points of each that tell something; fewer tell nothing of chance.
const LEAST_ROWS: usize = 8;
const LEAST_POINTS: usize = 8;
/// What is fitted to a line: a constant, a slope over tau', and cos and sin of each harmonic.
const TERMS: usize = 2 + 2 * LOCKING_HARMONICS;
/// Fewer frames do not tell so many terms from chance.
const LEAST_FRAMES: usize = 2 * TERMS;
/// A bias stands out if it exceeds this many of its standard deviations: the square is what chi squared of four degrees of freedom, the amplitudes of
/// two harmonics, exceeds once in a thousand, so that chance makes any disparity stand out no more often (Scheffe 1953).
const STANDS_OUT: f64 = 4.3;
/// A frame moved by a whole number of pixels but for this many steps of the table shows texture as the reference frame does.
const NEARLY_WHOLE: usize = FRACTIONS / 8;
/// Predictions are tabulated at this distance, in px: the second harmonic turns by 0.4 rad at most from one to the next, so that a straight line between
/// them misses 2 % of it.
const TABLE_STEP_PX: f64 = 1.0 / 32.0;
/// Points whose first and last frames differ by less than this part of the baseline are seen alike.
const SEEN_ALIKE: f64 = 0.02;

type Terms = SVector<f64, TERMS>;
type Normal = SMatrix<f64, TERMS, TERMS>;

/// sin and cos of every tabulated fraction of a turn.
pub(super) struct Turns(Vec<(f64, f64)>);

impl Turns {
    pub(super) fn new() -> Self {
        Self((0..FRACTIONS).map(|index| (TURN * index as f64 / FRACTIONS as f64).sin_cos()).collect())
    }

    /// sin and cos of h times the shift for each harmonic.
    fn harmonics(&self, fraction: usize) -> [(f64, f64); LOCKING_HARMONICS] {
        std::array::from_fn(|index| self.0[(index + 1) * fraction % FRACTIONS])
    }

    fn terms(&self, tau: f64, fraction: usize) -> Terms {
        let mut terms = Terms::zeros();
        (terms[0], terms[1]) = (1.0, tau);
        for (index, (sin, cos)) in self.harmonics(fraction).into_iter().enumerate() {
            (terms[2 + 2 * index], terms[3 + 2 * index]) = (cos, sin);
        }
        terms
    }
}

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
    /// Column of the sample, towards the smaller, and what is left of its place, in steps of the table.
    column: isize,
    fraction: usize,
}

/// The tabulated fraction of a pixel of `shift`, in px.
fn fraction(shift: f64) -> usize {
    ((shift * FRACTIONS as f64).round() as isize).rem_euclid(FRACTIONS as isize) as usize
}

/// Means and slopes of the harmonics over the frames that see a point.
struct Regression {
    /// u and m of the module's formula, with cos and less sin for real and imaginary part.
    mean: [(f64, f64); LOCKING_HARMONICS],
    slope: [(f64, f64); LOCKING_HARMONICS],
}

impl Regression {
    /// From tau' and fraction of each frame; without slopes if fewer than three frames see the point.
    fn of(turns: &Turns, sightings: impl Iterator<Item = (f64, usize)>) -> Self {
        let (mut count, mut tau_sum, mut squares) = (0.0, 0.0, 0.0);
        let mut mean = [(0.0, 0.0); LOCKING_HARMONICS];
        let mut slope = mean;
        for (tau, fraction) in sightings {
            count += 1.0;
            tau_sum += tau;
            squares += tau * tau;
            let sums = mean.iter_mut().zip(&mut slope);
            for ((mean, slope), (sin, cos)) in sums.zip(turns.harmonics(fraction)) {
                mean.0 += cos;
                mean.1 -= sin;
                slope.0 += tau * cos;
                slope.1 -= tau * sin;
            }
        }
        let spread = squares - tau_sum * tau_sum / count;
        for (mean, slope) in mean.iter_mut().zip(&mut slope) {
            *mean = (mean.0 / count, mean.1 / count);
            *slope = if count >= 3.0 {
                ((slope.0 - tau_sum * mean.0) / spread, (slope.1 - tau_sum * mean.1) / spread)
            } else {
                (0.0, 0.0)
            };
        }
        Self { mean, slope }
    }
}

/// Sums over points of the products of the module's formula.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Products {
    /// g_0^2.
    square: f64,
    /// For each harmonic those of alpha, kappa, gamma and Q.
    harmonics: [[f64; 4]; LOCKING_HARMONICS],
}

impl Products {
    fn of(values: &Terms, gradients: &Terms, weight: f64) -> Self {
        let gradient = gradients[0];
        let harmonic = |index: usize| {
            let (cos, sin) = (values[2 + 2 * index], values[3 + 2 * index]);
            let (cos_slope, sin_slope) = (gradients[2 + 2 * index], gradients[3 + 2 * index]);
            [
                weight * gradient * sin,
                weight * (sin_slope * cos - cos_slope * sin),
                weight * gradient * cos_slope,
                weight * (cos_slope * cos_slope + sin_slope * sin_slope),
            ]
        };
        Self { square: weight * gradient * gradient, harmonics: std::array::from_fn(harmonic) }
    }

    fn add(&mut self, other: &Self, sign: f64) {
        self.square += sign * other.square;
        let pairs = self.harmonics.iter_mut().flatten().zip(other.harmonics.iter().flatten());
        pairs.for_each(|(own, other)| *own += sign * other);
    }

    /// The bias that these products make, in px.
    fn bias(&self, regression: &Regression) -> f64 {
        let (mut moment, mut square) = (0.0, self.square);
        let harmonics = self.harmonics.iter().zip(regression.mean.iter().zip(&regression.slope));
        for ([alpha, kappa, gamma, q], (u, m)) in harmonics {
            moment += -alpha * m.1 - 0.5 * kappa * (u.1 * m.0 - u.0 * m.1);
            square += 2.0 * gamma * u.0 + 0.5 * q * (u.0 * u.0 + u.1 * u.1);
        }
        // Measured products may contradict each other; a gradient's square stays one.
        -moment / square.max(0.1 * self.square)
    }

    /// Amplitudes as displacements, in px: alpha's and kappa's of each harmonic.
    fn amplitudes(&self) -> [[f64; 2]; LOCKING_HARMONICS] {
        self.harmonics.map(|[alpha, kappa, ..]| [alpha / self.square, -0.5 * kappa / self.square])
    }
}

/// What the points of one row tell.
pub(super) struct RowSums {
    /// Whether their lines do; else their texture alone.
    from_lines: bool,
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
    pub(super) lines: &'a Lines,
    /// Disparities, NaN where there is none.
    pub(super) disparities: &'a [f32],
    /// First and last tau' in which each pixel is seen; `None`: wherever it is in the image.
    pub(super) stretches: Option<&'a [(f32, f32)]>,
    /// A point seen in fewer frames tells nothing.
    pub(super) minimum_frames: usize,
}

impl RowLines<'_> {
    /// First and last tau' in which the point at `x` is seen.
    fn seen(&self, x: usize, disparity: f64) -> (f64, f64) {
        let (low, high) = (1.0 - x as f64, (self.lines.columns() - 2) as f64 - x as f64);
        let (mut first, mut last) = (-self.lines.tau_before(), self.lines.tau_after());
        if disparity == 0.0 {
            if low > 0.0 || high < 0.0 {
                return (f64::INFINITY, f64::NEG_INFINITY);
            }
        } else {
            let ends = (low / disparity, high / disparity);
            first = first.max(ends.0.min(ends.1));
            last = last.min(ends.0.max(ends.1));
        }
        if let Some((from, to)) = self.stretches.map(|stretches| stretches[x]) {
            first = first.max(f64::from(from) - 1e-6);
            last = last.min(f64::from(to) + 1e-6);
        }
        (first, last)
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

    fn point(&self, (spline, turns): (&Spline, &Turns), epi: &SplineEpi, x: usize) -> Option<Point> {
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
        let (mut values, mut slopes) = (Terms::zeros(), Terms::zeros());
        let mut residuals = Vec::with_capacity(count);
        for sighting in &sightings {
            let taps = epi.taps(sighting.frame, sighting.column);
            let [value, slope, _] = spline.weights(sighting.fraction);
            let dot =
                |weights: &[f32]| weights.iter().zip(taps).map(|(weight, tap)| weight * tap).sum::<f32>();
            let (value, slope) = (f64::from(dot(value)), f64::from(dot(slope)));
            let terms = turns.terms(sighting.tau, sighting.fraction);
            values += terms * value;
            slopes += terms * slope;
            residuals.push(value);
        }
        (values, slopes) = (inverse * values, inverse * slopes);
        for (residual, sighting) in residuals.iter_mut().zip(&sightings) {
            *residual -= values.dot(&turns.terms(sighting.tau, sighting.fraction));
        }
        let spread = residuals.iter().map(|residual| residual * residual).sum::<f64>();
        let products = Products::of(&values, &slopes, 1.0);
        Some(Point { sightings, residuals, products, gradient: slopes[0], spread })
    }

    /// What the row's points tell; nothing if there are few.
    pub(super) fn sums(&self, spline: &Spline, turns: &Turns, epi: &SplineEpi) -> Option<RowSums> {
        let columns = (COLUMN_STEP / 2..self.lines.columns()).step_by(COLUMN_STEP);
        let points: Vec<Point> = columns.filter_map(|x| self.point((spline, turns), epi, x)).collect();
        if points.len() < LEAST_POINTS {
            return self.texture_sums(spline, epi);
        }
        let mut spreads: Vec<f64> = points.iter().map(|point| point.spread).collect();
        let quartile = spreads.len() / 4;
        let limit = BELIEVED * *spreads.select_nth_unstable_by(quartile, f64::total_cmp).1;
        let frames = vec![(0.0, 0.0); self.lines.frames()];
        let mut sums = RowSums { from_lines: true, products: Products::default(), frames };
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

    /// What the texture of the row's points tells of alpha: products of two frames, whose noise has nothing in common.
    fn texture_sums(&self, spline: &Spline, epi: &SplineEpi) -> Option<RowSums> {
        let reference = self.lines.reference();
        let mut pairs = Vec::new();
        for x in (COLUMN_STEP / 2..self.lines.columns()).step_by(COLUMN_STEP) {
            let sightings = self.sightings(x, f64::from(self.disparities[x]));
            let off = |sighting: &Sighting| sighting.fraction.min(FRACTIONS - sighting.fraction);
            let others = sightings.iter().filter(|other| other.frame != reference);
            let partner = others.min_by_key(|other| (off(other), other.frame.abs_diff(reference)));
            if let Some(partner) = partner.filter(|partner| off(partner) <= NEARLY_WHOLE) {
                let whole = partner.column + isize::from(partner.fraction > FRACTIONS / 2);
                pairs.push((epi.taps(reference, x as isize), epi.taps(partner.frame, whole)));
            }
        }
        if pairs.len() < LEAST_POINTS {
            return None;
        }
        // Products of what `fraction` and `order` make of both frames, less their means.
        let covariance = |fraction: usize, order: usize| {
            let weights = &spline.weights(fraction)[order];
            let dot = |taps: &[f32]| {
                weights.iter().zip(taps).map(|(weight, tap)| f64::from(weight * tap)).sum::<f64>()
            };
            let values: Vec<(f64, f64)> = pairs.iter().map(|(one, other)| (dot(one), dot(other))).collect();
            let count = values.len() as f64;
            let sums = values.iter().fold((0.0, 0.0), |sum, pair| (sum.0 + pair.0, sum.1 + pair.1));
            values.iter().map(|pair| (pair.0 - sums.0 / count) * (pair.1 - sums.1 / count)).sum::<f64>()
        };
        let lost = covariance(0, 0) - covariance(FRACTIONS / 2, 0);
        let mut products = Products { square: covariance(0, 1), ..Products::default() };
        products.harmonics[0][0] = -PI / 4.0 * lost;
        Some(RowSums { from_lines: false, products, frames: Vec::new() })
    }
}

/// What was measured, and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Amplitudes {
    /// Whether lines tell them; else the texture alone does, and they are mostly overstated.
    from_lines: bool,
    all: Products,
    /// Without each row (Tukey's jackknife): how they differ tells what chance makes of noise and texture.
    without: Vec<Products>,
    /// What errors of the frames' positions may feign of an amplitude, in px.
    feigned_px: f64,
}

impl Amplitudes {
    pub(super) fn of(rows: &[RowSums]) -> Option<Self> {
        let with_lines = rows.iter().filter(|row| row.from_lines).count();
        let from_lines = with_lines >= LEAST_ROWS;
        let rows = || rows.iter().filter(|row| row.from_lines == from_lines);
        let first = rows().next()?;
        let mut all = Products::default();
        let mut frames = vec![(0.0, 0.0); first.frames.len()];
        for row in rows() {
            all.add(&row.products, 1.0);
            for (sum, frame) in frames.iter_mut().zip(&row.frames) {
                *sum = (sum.0 + frame.0, sum.1 + frame.1);
            }
        }
        let without = rows().map(|row| {
            let mut without = all;
            without.add(&row.products, -1.0);
            without
        });
        let without: Vec<Products> = without.collect();
        if without.len() < LEAST_ROWS || without.iter().any(|products| products.square <= 0.0) {
            return None;
        }
        // A frame beside its position displaces all of its points.
        let errors = frames.iter().filter(|frame| frame.1 > 0.0).map(|frame| (frame.0 / frame.1).powi(2));
        let feigned_px = if from_lines {
            let spare = (frames.len() - TERMS) as f64;
            (errors.sum::<f64>() / spare * 2.0 / frames.len() as f64).sqrt()
        } else {
            0.0
        };
        Some(Self { from_lines, all, without, feigned_px })
    }

    /// Standard deviation of a quantity by the jackknife.
    fn sigma(&self, quantity: impl Fn(&Products) -> f64) -> f64 {
        let count = self.without.len() as f64;
        let (mut sum, mut squares) = (0.0, 0.0);
        // Differences from the whole, so that squares lose nothing.
        let whole = quantity(&self.all);
        for without in &self.without {
            let difference = quantity(without) - whole;
            sum += difference;
            squares += difference * difference;
        }
        ((squares - sum * sum / count).max(0.0) * (count - 1.0) / count).sqrt()
    }

    /// The amplitudes of the harmonics with their sigmas.
    fn harmonics(&self) -> [LockingHarmonic; LOCKING_HARMONICS] {
        let amplitudes = self.all.amplitudes();
        std::array::from_fn(|index| {
            let sigma = |kind: usize| self.sigma(|products| products.amplitudes()[index][kind]);
            LockingHarmonic {
                interpolation_px: amplitudes[index][0],
                interpolation_sigma_px: sigma(0).hypot(self.feigned_px),
                aliasing_px: amplitudes[index][1],
                aliasing_sigma_px: sigma(1),
            }
        })
    }

    /// As they are handed on.
    pub(super) fn stated(&self) -> LockingAmplitudes {
        LockingAmplitudes { harmonics: self.harmonics(), from_lines: self.from_lines }
    }

    /// Whether any amplitude stands out from chance.
    pub(super) fn stand_out(&self) -> bool {
        self.harmonics().iter().any(|harmonic| {
            harmonic.interpolation_px.abs() > STANDS_OUT * harmonic.interpolation_sigma_px
                || harmonic.aliasing_px.abs() > STANDS_OUT * harmonic.aliasing_sigma_px
        })
    }

    /// The bias that they predict, in px; 0 where it does not stand out from chance.
    fn bias(&self, regression: &Regression) -> f64 {
        let predicted = self.all.bias(regression);
        let feigned = regression.slope.iter().map(|slope| (self.feigned_px * slope.1).powi(2)).sum::<f64>();
        let sigma = self.sigma(|products| products.bias(regression)).hypot(feigned.sqrt());
        if predicted.abs() > STANDS_OUT * sigma { predicted } else { 0.0 }
    }
}

/// Predicted biases of points that all frames see, tabulated over the disparity, and of others one by one.
pub(super) struct Prediction<'a> {
    amplitudes: &'a Amplitudes,
    turns: &'a Turns,
    lines: &'a Lines,
    first_px: f64,
    biases: Vec<f64>,
}

impl<'a> Prediction<'a> {
    /// For disparities from `low` to `high`.
    pub(super) fn new(
        amplitudes: &'a Amplitudes,
        turns: &'a Turns,
        lines: &'a Lines,
        (low, high): (f32, f32),
    ) -> Self {
        let first_px = f64::from(low);
        let steps = ((f64::from(high) - first_px) / TABLE_STEP_PX).ceil() as usize + 2;
        let mut prediction = Self { amplitudes, turns, lines, first_px, biases: Vec::new() };
        prediction.biases = (0..steps)
            .into_par_iter()
            .map(|index| prediction.of_frames(first_px + index as f64 * TABLE_STEP_PX, (-1.0, 1.0)))
            .collect();
        prediction
    }

    /// The bias of a point of `disparity` that is seen from `first` to `last` tau'.
    fn of_frames(&self, disparity: f64, (first, last): (f64, f64)) -> f64 {
        let seen = self.lines.offsets().iter().filter(|&&tau| tau >= first && tau <= last);
        let regression = Regression::of(self.turns, seen.map(|&tau| (tau, fraction(disparity * tau))));
        self.amplitudes.bias(&regression)
    }

    /// The biases of a row's pixels, in px, into `out`.
    pub(super) fn row(&self, row: RowLines<'_>, out: &mut [f32]) {
        let whole = (-self.lines.tau_before(), self.lines.tau_after());
        // Neighbours that are seen alike share what was predicted for the first of them.
        let mut shared = (f64::NAN, whole, 0.0);
        for (x, (out, &disparity)) in out.iter_mut().zip(row.disparities).enumerate() {
            let disparity = f64::from(disparity);
            *out = if disparity.is_nan() {
                0.0
            } else {
                let seen = row.seen(x, disparity);
                if seen == whole {
                    self.tabulated(disparity)
                } else {
                    let alike = (disparity - shared.0).abs() <= TABLE_STEP_PX
                        && (seen.0 - shared.1.0).abs() <= SEEN_ALIKE
                        && (seen.1 - shared.1.1).abs() <= SEEN_ALIKE;
                    if !alike {
                        shared = (disparity, seen, self.of_frames(disparity, seen));
                    }
                    shared.2
                }
            } as f32;
        }
    }

    fn tabulated(&self, disparity: f64) -> f64 {
        let place = ((disparity - self.first_px) / TABLE_STEP_PX).max(0.0);
        let index = (place as usize).min(self.biases.len() - 2);
        let share = place - index as f64;
        self.biases[index] + share * (self.biases[index + 1] - self.biases[index])
    }
}
