//! Costs of candidates from the samples of all frames.
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

use super::CostTable;
use crate::candidates::Candidates;
use crate::lines::{EpiLines, SeenRule};
use crate::options::{MatchOptions, Method};
pub(crate) use band::Band;

/// Costs of all candidates of the answered rows of `band`, one table for each.
pub(crate) fn band_costs(
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
