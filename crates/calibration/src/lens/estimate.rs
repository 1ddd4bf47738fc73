//! A lens and how well it is known.

use serde::{Deserialize, Serialize};

use super::Lens;

/// A lens with the covariance of its parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensEstimate {
    /// Rows of the frames it was found for.
    pub rows: usize,
    /// Columns of the frames.
    pub columns: usize,
    /// The lens.
    pub lens: Lens,
    /// Covariance of its parameters in the order of [`Lens::to_array`]. A parameter with variance 0 is held
    /// as it is.
    pub covariance: [[f64; Lens::PARAMETERS]; Lens::PARAMETERS],
}

impl LensEstimate {
    /// A lens whose parameters are known independently, each with its standard deviation; 0 for one that is
    /// held.
    pub fn independent(rows: usize, columns: usize, lens: Lens, sigma: [f64; Lens::PARAMETERS]) -> Self {
        let mut covariance = [[0.0; Lens::PARAMETERS]; Lens::PARAMETERS];
        for (index, sigma) in sigma.iter().enumerate() {
            covariance[index][index] = sigma * sigma;
        }
        Self { rows, columns, lens, covariance }
    }

    /// Standard deviation of each parameter, in the order of [`Lens::to_array`].
    pub fn sigma(&self) -> [f64; Lens::PARAMETERS] {
        std::array::from_fn(|index| self.covariance[index][index].sqrt())
    }
}
