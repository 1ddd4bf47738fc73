//! Costs of candidates: how badly the samples along a line agree.
//!
//! A cost row for one disparity is made of shifted rows only, so the kernels run over whole rows. Rows are
//! treated in bands that share their neighbours' samples: a window of 7 rows then costs little more than one of 1 row.

mod correlation;
mod kernels;
#[cfg(test)]
mod reference_tests;
mod variance;

use super::interpolation::SampledEpi;
use super::lines::{Candidates, Lines, SeenRule};
use super::options::{MatchOptions, Method, Occlusion};
use epirig_core::volume::Volume;

/// Costs of all candidates of one EPI: candidates x columns; NaN where too few frames see the candidate.
///
/// `Method::Variance` and `Method::Normalised`: unbiased variance in DN^2 of the volume searched, from 0. Correlation: 1 - correlation, in [0, 2].
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

/// Rows that are matched together, with the rows around them that their windows reach.
pub(super) struct Band {
    /// Rows of the volume whose samples are held.
    paths: std::ops::Range<usize>,
    /// Rows that are answered.
    answered: std::ops::Range<usize>,
    /// Half of the window's side, rounded down.
    half: usize,
    /// The held rows, prepared for sampling.
    epis: Vec<SampledEpi>,
}

impl Band {
    pub(super) fn new(volume: &Volume, answered: std::ops::Range<usize>, options: &MatchOptions) -> Self {
        let half = options.window_px / 2;
        let paths = answered.start.saturating_sub(half)..(answered.end + half).min(volume.rows());
        let epis = paths.clone().map(|y| SampledEpi::new(volume, y, options.interpolation, half)).collect();
        Self { paths, answered, half, epis }
    }

    /// The held rows, as indices into `epis`, that the window around answered row `index` covers.
    fn window_rows(&self, index: usize) -> std::ops::Range<usize> {
        let y = self.answered.start + index;
        let first = y.saturating_sub(self.half).max(self.paths.start);
        let end = (y + self.half + 1).min(self.paths.end);
        first - self.paths.start..end - self.paths.start
    }
}

/// Costs of all candidates of the answered rows of `band`, one table for each.
pub(super) fn band_costs(
    band: &Band,
    lines: &Lines,
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
        method => {
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

/// Cost from the sums of the frames before and after the reference frame: the mean over all frames that see the candidate,
/// or over one side alone if that is better and may be. `cost` turns (sums, number of frames) into a cost.
#[inline(always)]
fn best_side<const N: usize>(
    before: [f32; N],
    after: [f32; N],
    frames: [u16; 2],
    rule: SeenRule,
    cost: impl Fn([f32; N], f32) -> f32,
) -> f32 {
    let [seen_before, seen_after] = frames.map(usize::from);
    // The reference frame, counted on both sides, adds nothing to the sums of either.
    let seen = (seen_before + seen_after).saturating_sub(1);
    let mut best = f32::NAN;
    if rule.suffices(seen) {
        let both = std::array::from_fn(|index| before[index] + after[index]);
        best = cost(both, seen as f32);
    }
    if rule.occlusion == Occlusion::OneSide {
        if rule.suffices(seen_before) {
            best = best.min(cost(before, seen_before as f32));
        }
        if rule.suffices(seen_after) {
            best = best.min(cost(after, seen_after as f32));
        }
    }
    best
}
