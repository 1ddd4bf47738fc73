//! Matching cost: how badly the samples along a line agree.
//!
//! The exhaustive cost of a candidate comes from the samples of all frames (`exhaustive`), as in the paper.
//! The factorised one makes most of the sums once for many candidates (`factorised`).

pub(crate) mod changing_light;
pub(crate) mod contrast;
pub(crate) mod exhaustive;
pub(crate) mod factorised;
pub(crate) mod interpolation;
pub(crate) mod linear_epi;
pub(crate) mod normalise;

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
    pub(crate) fn from_values(columns: usize, values: Vec<f32>) -> Self {
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

    pub(crate) fn row_mut(&mut self, k: usize) -> &mut [f32] {
        &mut self.values[k * self.columns..(k + 1) * self.columns]
    }
}
