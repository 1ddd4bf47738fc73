//! Comparison with the truth.

use serde::Serialize;
use thiserror::Error;

use epirig_core::fault::{Blame, Fault};
use epirig_core::grid::Grid;

/// The maps to be compared do not cover the same pixels.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "the map is {columns} x {rows} pixels, the truth {truth_columns} x {truth_rows}; compare maps of the same frame"
)]
pub struct SizeMismatch {
    /// Rows of the map.
    pub rows: usize,
    /// Columns of the map.
    pub columns: usize,
    /// Rows of the truth.
    pub truth_rows: usize,
    /// Columns of the truth.
    pub truth_columns: usize,
}

impl Fault for SizeMismatch {
    fn blame(&self) -> Blame {
        Blame::Request
    }
}

/// Errors of a set of pixels, in px; zeros if no pixel is answered.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[non_exhaustive]
pub struct ErrorStatistics {
    /// Pixels with a truth.
    pub pixels: usize,
    /// Pixels with a truth and an answer.
    pub answered: usize,
    /// Mean of |error|.
    pub mean_px: f64,
    /// Median of |error|.
    pub median_px: f64,
    /// Root of the mean squared error.
    pub rms_px: f64,
    /// 99th percentile of |error|.
    pub percentile_99_px: f64,
    /// Largest |error|.
    pub maximum_px: f64,
    /// Mean of the signed error.
    pub bias_px: f64,
    /// Share of the answered pixels whose |error| is below their sigma; 0.68 for an honest sigma.
    pub within_1_sigma: f64,
    /// Share below twice their sigma; 0.95 for an honest sigma.
    pub within_2_sigma: f64,
}

/// Errors over all pixels with a truth, and over those whose point is in the image in both the first and the
/// last frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TruthReport {
    /// All pixels with a truth.
    pub all: ErrorStatistics,
    /// Those whose point lies in the first and in the last frame.
    pub in_both_end_frames: ErrorStatistics,
}

/// Compares a disparity map and its sigma (empty shares without one) with the truth for the same reference
/// frame, which has `tau_before` of the baseline before it and `tau_after` after it.
///
/// # Errors
/// [`SizeMismatch`].
pub fn compare_with_truth(
    disparity: &Grid<f32>,
    sigma: Option<&Grid<f32>>,
    truth: &Grid<f32>,
    (tau_before, tau_after): (f64, f64),
) -> Result<TruthReport, SizeMismatch> {
    let (rows, columns) = (disparity.rows(), disparity.columns());
    let alike = |other: &Grid<f32>| other.rows() == rows && other.columns() == columns;
    if !alike(truth) || sigma.is_some_and(|sigma| !alike(sigma)) {
        let (truth_rows, truth_columns) = (truth.rows(), truth.columns());
        return Err(SizeMismatch { rows, columns, truth_rows, truth_columns });
    }
    let mut all = Errors::default();
    let mut in_both_end_frames = Errors::default();
    let last = (columns - 1) as f64;
    for (index, (&found, &truth)) in disparity.values().iter().zip(truth.values()).enumerate() {
        if truth.is_nan() {
            continue;
        }
        let sigma = sigma.map_or(f32::NAN, |sigma| sigma.values()[index]);
        all.add(found, truth, sigma);
        let x = (index % columns) as f64;
        let ends = [x - f64::from(truth) * tau_before, x + f64::from(truth) * tau_after];
        if ends.iter().all(|end| (0.0..=last).contains(end)) {
            in_both_end_frames.add(found, truth, sigma);
        }
    }
    Ok(TruthReport { all: all.statistics(), in_both_end_frames: in_both_end_frames.statistics() })
}

#[derive(Default)]
struct Errors {
    pixels: usize,
    errors: Vec<f64>,
    within: [usize; 2],
}

impl Errors {
    fn add(&mut self, found: f32, truth: f32, sigma: f32) {
        self.pixels += 1;
        if found.is_nan() {
            return;
        }
        let error = f64::from(found) - f64::from(truth);
        self.errors.push(error);
        for (count, factor) in self.within.iter_mut().zip([1.0, 2.0]) {
            *count += usize::from(error.abs() <= factor * f64::from(sigma));
        }
    }

    fn statistics(mut self) -> ErrorStatistics {
        let answered = self.errors.len();
        if answered == 0 {
            return ErrorStatistics { pixels: self.pixels, ..ErrorStatistics::default() };
        }
        let count = answered as f64;
        let bias_px = self.errors.iter().sum::<f64>() / count;
        let rms_px = (self.errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
        self.errors.iter_mut().for_each(|error| *error = error.abs());
        self.errors.sort_unstable_by(f64::total_cmp);
        ErrorStatistics {
            pixels: self.pixels,
            answered,
            mean_px: self.errors.iter().sum::<f64>() / count,
            median_px: self.errors[answered / 2],
            rms_px,
            percentile_99_px: self.errors[(answered * 99 / 100).min(answered - 1)],
            maximum_px: self.errors[answered - 1],
            bias_px,
            within_1_sigma: self.within[0] as f64 / count,
            within_2_sigma: self.within[1] as f64 / count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_counted_where_there_is_a_truth() {
        let nan = f32::NAN;
        let found = Grid::from_values(1, 5, vec![1.1, nan, 2.0, 0.7, 9.0]).unwrap();
        let truth = Grid::from_values(1, 5, vec![1.0, 1.0, 2.0, 1.0, nan]).unwrap();
        let sigma = Grid::filled(1, 5, 0.2);
        let report = compare_with_truth(&found, Some(&sigma), &truth, (0.0, 1.0)).unwrap();
        assert_eq!((report.all.pixels, report.all.answered), (4, 3));
        assert!((report.all.mean_px - 0.4 / 3.0).abs() < 1e-6);
        assert!((report.all.maximum_px - 0.3).abs() < 1e-6);
        assert!((report.all.bias_px + 0.2 / 3.0).abs() < 1e-6);
        assert!((report.all.within_1_sigma - 2.0 / 3.0).abs() < 1e-9);
        assert_eq!(report.all.within_2_sigma, 1.0);
        // Column 3 with disparity 1 ends at column 4, the last one.
        assert_eq!(report.in_both_end_frames.pixels, 4);
        assert!(compare_with_truth(&found, None, &Grid::filled(2, 5, 0.0), (0.0, 1.0)).is_err());
    }
}
