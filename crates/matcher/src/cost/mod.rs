//! Costs of candidates: how badly the samples along a line agree.
//!
//! A cost row for one disparity is made of shifted rows only, so the kernels run over whole rows. Rows are
//! treated in bands that share their neighbours' samples: a window of 7 rows then costs little more than one
//! of 1 row.

mod band;
mod correlation;
mod kernels;
#[cfg(test)]
mod reference_tests;
mod sides;
mod variance;

use super::candidates::Candidates;
use super::lines::{EpiLines, SeenRule};
use super::options::{MatchOptions, Method};
pub(crate) use band::Band;

/// Costs of all candidates of one EPI: candidates x columns; NaN where too few frames see the candidate.
///
/// `Method::Variance` and `Method::Normalised`: unbiased variance in DN^2 of the volume searched, from 0.
/// Correlation: 1 - correlation, in [0, 2].
#[derive(Debug, Clone, PartialEq)]
pub struct CostTable {
    columns: usize,
    values: Vec<f32>,
}

impl CostTable {
    /// A table over existing costs, one row of `columns` for each candidate.
    ///
    /// # Panics
    /// If the number of values is no multiple of `columns`.
    pub fn from_values(columns: usize, values: Vec<f32>) -> Self {
        assert!(columns > 0 && values.len().is_multiple_of(columns));
        Self { columns, values }
    }

    /// Number of candidates.
    pub fn candidates(&self) -> usize {
        self.values.len() / self.columns
    }

    /// Number of columns of the reference frame.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Costs of candidate `k` for all columns.
    pub fn row(&self, k: usize) -> &[f32] {
        &self.values[k * self.columns..(k + 1) * self.columns]
    }

    /// Cost of candidate `k` at column `x`.
    pub fn at(&self, k: usize, x: usize) -> f32 {
        self.values[k * self.columns + x]
    }

    pub(super) fn row_mut(&mut self, k: usize) -> &mut [f32] {
        &mut self.values[k * self.columns..(k + 1) * self.columns]
    }
}

/// Costs of all candidates of the answered rows of `band`, one table for each.
pub(super) fn band_costs(
    band: &Band,
    lines: &EpiLines,
    candidates: &Candidates,
    rule: SeenRule,
    options: &MatchOptions,
) -> Vec<CostTable> {
    let empty = vec![f32::NAN; candidates.count() * lines.columns()];
    let mut tables = vec![CostTable::from_values(lines.columns(), empty); band.answered.len()];
    let mut kind = match options.method {
        Method::Variance | Method::Normalised => {
            Kind::Variance(variance::Variance::new(band, lines, options.interpolation))
        }
        method @ (Method::NccFirst | Method::NccMean) => {
            Kind::Correlation(correlation::Correlation::new(band, lines, options.interpolation, method))
        }
    };
    for k in 0..candidates.count() {
        let disparity_px = candidates.disparity_px(k as f64);
        let rows = tables.iter_mut().map(|table| table.row_mut(k));
        match &mut kind {
            Kind::Variance(costs) => costs.fill(disparity_px, rule, rows),
            Kind::Correlation(costs) => costs.fill(disparity_px, rule, rows),
        }
    }
    tables
}

enum Kind<'a> {
    Variance(variance::Variance<'a>),
    Correlation(correlation::Correlation<'a>),
}
