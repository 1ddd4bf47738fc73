//! Two levels over a trend, found together from the heights alone.

use nalgebra::DVector;

use super::super::normal::{MOST_TERMS, Normal, Solution};
use super::super::trend::at;
use epirig_core::statistics::{SIGMA_OF_MEDIAN, quantile};

/// Most rounds. A field of two levels converges in fewer; one of a single level may not, and is refused
/// later.
const ROUNDS: usize = 60;
/// Numbers of terms of a constant, a plane and a quadric.
const SIMPLER: [usize; 3] = [1, 3, 6];
/// A start needs this share of the field for each level.
const LEAST_SHARE: f64 = 0.002;
/// Two levels are accepted if fewer pixels lie between them than this share of those at either. One Gaussian
/// level, cut in two, has more in between than at its seeming levels.
const VALLEY: f64 = 0.75;

/// A smoothed height with the terms of the trend.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub(super) row: [f64; MOST_TERMS],
    pub(super) height_mm: f64,
}

/// A trend for the upper level, and how far the lower one lies below it.
#[derive(Debug, Clone)]
pub(super) struct Levels {
    /// Of the upper level, in the units of the terms.
    pub(super) coefficients: Vec<f64>,
    pub(super) depth_mm: f64,
}

impl Levels {
    pub(super) fn upper_mm(&self, row: &[f64; MOST_TERMS]) -> f64 {
        at(&self.coefficients, row)
    }

    /// 1 for each point that is nearer to the lower level, else 0.
    fn low(&self, points: &[Point]) -> Vec<f64> {
        let is_low = |point: &Point| self.is_low(&point.row, point.height_mm);
        points.iter().map(|point| f64::from(u8::from(is_low(point)))).collect()
    }

    /// Whether a height is nearer to the lower level.
    pub(super) fn is_low(&self, row: &[f64; MOST_TERMS], height_mm: f64) -> bool {
        self.upper_mm(row) - height_mm > 0.5 * self.depth_mm
    }

    /// Whether there is a valley between the levels in how often heights occur.
    pub(super) fn are_two(&self, points: &[Point]) -> bool {
        let mut near = [0_usize; 3];
        for point in points {
            let below = (self.upper_mm(&point.row) - point.height_mm) / self.depth_mm;
            for (count, level) in near.iter_mut().zip([0.0, 0.5, 1.0]) {
                *count += usize::from((below - level).abs() < 0.125);
            }
        }
        (near[1] as f64) < VALLEY * near[0].min(near[2]) as f64
    }
}

/// The most likely two levels: a mixture of two Gaussians of one width about a trend, and about the same
/// trend a depth below (expectation and maximisation, Dempster et al. 1977). `middle` is a trend through the
/// whole field.
///
/// It climbs to the nearest maximum, so there are several starts. About `middle`: as much high as low, little
/// low, little high. And the levels over a simpler trend, which cannot bow so as to stand in for a wall.
pub(super) fn two_levels(points: &[Point], middle: &[f64]) -> Option<Levels> {
    let mut simpler: Option<Levels> = None;
    for terms in SIMPLER.into_iter().filter(|&terms| terms < middle.len()) {
        let whole = Whole::new(points, terms)?;
        let halved = below(points, whole.solution.values.as_slice(), 0.0);
        let starts = simpler.as_ref().map(|levels| levels.low(points)).into_iter().chain([halved]);
        simpler = most_likely(points, &whole, starts).or(simpler);
    }
    let mut about: Vec<f64> = points.iter().map(|point| point.height_mm - at(middle, &point.row)).collect();
    let median = quantile(&mut about, 0.5)?;
    about.iter_mut().for_each(|value| *value = (*value - median).abs());
    let scatter = SIGMA_OF_MEDIAN * quantile(&mut about, 0.5)?;
    let limits = [median, median - 3.0 * scatter, median + 3.0 * scatter];
    let starts = limits.map(|limit| below(points, middle, limit));
    let starts = starts.into_iter().chain(simpler.map(|levels| levels.low(points)));
    most_likely(points, &Whole::new(points, middle.len())?, starts)
}

/// 1 for each point whose height over a trend is less than `limit`, else 0.
fn below(points: &[Point], trend: &[f64], limit: f64) -> Vec<f64> {
    let is_below = |point: &Point| point.height_mm - at(trend, &point.row) < limit;
    points.iter().map(|point| f64::from(u8::from(is_below(point)))).collect()
}

fn most_likely(points: &[Point], whole: &Whole, starts: impl Iterator<Item = Vec<f64>>) -> Option<Levels> {
    starts
        .filter_map(|low| mixture(points, whole, low))
        .max_by(|one, other| one.1.total_cmp(&other.1))
        .map(|(levels, _)| levels)
}

/// Levels and the logarithm of their likelihood; `low` is how probably each point is low.
fn mixture(points: &[Point], whole: &Whole, mut low: Vec<f64>) -> Option<(Levels, f64)> {
    let count = points.len() as f64;
    let mut found = None;
    for _ in 0..ROUNDS {
        let share = low.iter().sum::<f64>() / count;
        if !(LEAST_SHARE..=1.0 - LEAST_SHARE).contains(&share) {
            return found;
        }
        let levels = whole.levels(points, &low)?;
        let depth_mm = levels.depth_mm;
        let below: Vec<f64> =
            points.iter().map(|point| levels.upper_mm(&point.row) - point.height_mm).collect();
        let mut squares = 0.0;
        for (&below, &low) in below.iter().zip(&low) {
            squares += below * below + low * depth_mm * (depth_mm - 2.0 * below);
        }
        let variance = (squares / count).max(f64::MIN_POSITIVE);
        let prior = (share / (1.0 - share)).ln();
        let mut likelihood = count * ((1.0 - share).ln() - 0.5 * variance.ln());
        // Factors of 1 to 2: one logarithm does for many.
        let mut product = 1.0_f64;
        for (&below, low) in below.iter().zip(&mut low) {
            // By how much low is more likely than high, as a logarithm.
            let odds = prior + 0.5 * depth_mm * (2.0 * below - depth_mm) / variance;
            let less_likely = (-odds.abs()).exp();
            let probability_of_likelier = 1.0 / (1.0 + less_likely);
            *low = if odds > 0.0 { probability_of_likelier } else { 1.0 - probability_of_likelier };
            product *= 1.0 + less_likely;
            if product > 1e300 {
                likelihood += product.ln();
                product = 1.0;
            }
            likelihood += odds.max(0.0) - 0.5 * below * below / variance;
        }
        likelihood += product.ln();
        let settled =
            found.as_ref().is_some_and(|(_, before): &(Levels, f64)| likelihood - before < 1e-5 * count);
        if depth_mm > 0.0 {
            found = Some((levels, likelihood));
        }
        if settled {
            break;
        }
    }
    found
}

/// The part of the normal equations that does not depend on which points are low: each point counts once,
/// whichever level it is on.
struct Whole {
    terms: usize,
    solution: Solution,
}

impl Whole {
    fn new(points: &[Point], terms: usize) -> Option<Self> {
        let mut sums = Normal::empty();
        points.iter().for_each(|point| sums.add(&point.row[..terms], point.height_mm, 1.0));
        Some(Self { terms, solution: sums.solve(terms)? })
    }

    /// Trend and depth that fit best. The low points' terms sum to s. So the trend is that of the whole,
    /// raised by depth times A^-1 s (A from the whole's normal equations), and the depth follows from the
    /// rest of its own equation.
    fn levels(&self, points: &[Point], low: &[f64]) -> Option<Levels> {
        let mut terms = DVector::zeros(self.terms);
        let (mut weights, mut heights) = (0.0, 0.0);
        for (point, &low) in points.iter().zip(low) {
            terms.iter_mut().zip(&point.row).for_each(|(sum, term)| *sum += low * term);
            weights += low;
            heights += low * point.height_mm;
        }
        let raised = &self.solution.inverse * &terms;
        let rest = weights - raised.dot(&terms);
        // As little of the depth's own as this is nothing: the trend could stand in for it.
        if rest <= 1e-10 * weights {
            return None;
        }
        let depth_mm = (self.solution.values.dot(&terms) - heights) / rest;
        let coefficients = &self.solution.values + raised * depth_mm;
        Some(Levels { coefficients: coefficients.as_slice().to_vec(), depth_mm })
    }
}
