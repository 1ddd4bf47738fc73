//! The start of a robust fit: a trend that outliers do not influence (least trimmed squares).

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::SurfaceError;
use super::normal::Normal;
use super::trend::{Field, Sample, at};
use epirig_core::statistics::quantile;

/// The best share of the field decides, so that up to a quarter may be wrong. Half would leave the choice
/// between a trend of one level and one through the middle of two to chance where as much is hollow as not.
const SHARE: f64 = 0.75;
/// Number of trials. If a quarter of the points is wrong, one trial in 18 of the longest form meets ten
/// right points; that none of these trials does has a probability of 1e-5.
const TRIALS: usize = 200;
/// Points that trials are judged by.
const POINTS: usize = 2_000;
/// Fits to the best share, after which it no longer changes (the concentration of Rousseeuw and Van Driessen,
/// 1999).
const ROUNDS: usize = 10;

impl Field<'_> {
    /// Coefficients (in the units of the terms) by least trimmed squares: of trends through a few points each
    /// the one that keeps most of the field near, then fitted to that.
    pub(super) fn start(&self) -> Result<Vec<f64>, SurfaceError> {
        let all: Vec<Sample> = self.samples().collect();
        // The same field gives the same trend: the numbers are drawn from a fixed seed.
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let mut draw = || all[random.random_range(0..all.len())];
        let points: Vec<Sample> = (0..POINTS.min(all.len())).map(|_| draw()).collect();
        let mut best: Option<(Vec<f64>, f64)> = None;
        for _ in 0..TRIALS {
            let few: Vec<Sample> = (0..self.basis.terms()).map(|_| draw()).collect();
            let Some(trial) = self.fitted_to(&few) else { continue };
            let off = self.spread(&trial, &points);
            if best.as_ref().is_none_or(|(_, before)| off < *before) {
                best = Some((trial, off));
            }
        }
        // If no points determine a trend, all of them together may.
        let Some((mut trend, mut off)) = best else {
            return self.fitted_to(&all).ok_or_else(|| self.undetermined());
        };
        for _ in 0..ROUNDS {
            let near: Vec<Sample> =
                points.iter().filter(|sample| self.off(&trend, sample) <= off).copied().collect();
            let Some(next) = self.fitted_to(&near) else { break };
            off = self.spread(&next, &points);
            trend = next;
        }
        Ok(trend)
    }

    fn fitted_to(&self, samples: &[Sample]) -> Option<Vec<f64>> {
        let terms = self.basis.terms();
        let mut sums = Normal::empty();
        for sample in samples {
            sums.add(&sample.row[..terms], sample.height_mm, sample.sigma_mm.powi(-2));
        }
        Some(sums.solve(terms)?.values.as_slice().to_vec())
    }

    /// How far a pixel lies off a trend, in units of its sigma.
    pub(super) fn off(&self, coefficients: &[f64], sample: &Sample) -> f64 {
        (sample.height_mm - at(coefficients, &sample.row)).abs() / sample.sigma_mm
    }

    /// The deviation within which the best share of the points lies.
    fn spread(&self, coefficients: &[f64], points: &[Sample]) -> f64 {
        let mut all: Vec<f64> = points.iter().map(|sample| self.off(coefficients, sample)).collect();
        quantile(&mut all, SHARE).unwrap_or(f64::INFINITY)
    }
}
