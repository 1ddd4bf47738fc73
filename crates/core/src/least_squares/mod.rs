//! Least squares for problems whose residuals come in small blocks, such as bundle adjustment: lens, stage
//! axis and positions.
//!
//! Damped Gauss-Newton steps (Levenberg and Marquardt; Marquardt 1963) on dense normal equations: the
//! problems here have some hundred parameters and some ten thousand residuals, each of which depends on a
//! dozen parameters.

mod solve;

use nalgebra::DMatrix;
use thiserror::Error;

pub use solve::minimise;

/// Residuals that belong together, such as both coordinates of one point.
#[derive(Debug, Clone, Copy)]
pub struct Block<'a> {
    /// Measured less predicted, each in units of its own standard deviation.
    pub residuals: &'a [f64],
    /// The parameters on which they depend, by index.
    pub columns: &'a [usize],
    /// Derivatives of the *prediction*, in the same units: residuals x columns, row by row.
    pub jacobian: &'a [f64],
    /// Whether it may be an outlier, so that a robust loss applies; priors may not.
    pub may_be_wrong: bool,
}

/// A least-squares problem.
pub trait Problem {
    /// Number of parameters.
    fn parameters(&self) -> usize;

    /// Gives all blocks of residuals at `parameters`, in the same order every time.
    fn blocks(&self, parameters: &[f64], give: &mut dyn FnMut(Block<'_>));

    /// Goes a step from `parameters`; addition, unless parameters live on something curved, such as
    /// rotations.
    fn step(&self, parameters: &mut [f64], step: &[f64]) {
        parameters.iter_mut().zip(step).for_each(|(parameter, step)| *parameter += step);
    }
}

/// How blocks that may be wrong are weighed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// By their squares: optimal for Gaussian errors, helpless against others.
    Squares,
    /// Huber's: squares up to this many standard deviations (of the block's norm), linear beyond.
    Huber(f64),
}

/// The minimum, with its covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// Best parameters.
    pub parameters: Vec<f64>,
    /// Inverse of the normal equations: the covariance of the parameters, if the standard deviations of the
    /// residuals are right. Times [`variance_factor`](Self::variance_factor), if they are right up to a
    /// common factor.
    pub covariance: DMatrix<f64>,
    /// Weighted sum of the squared residuals.
    pub sum_of_squares: f64,
    /// Number of residuals.
    pub residuals: usize,
    /// Steps taken.
    pub steps: usize,
}

impl Minimum {
    /// Sum of squares over degrees of freedom: 1 if the residuals are as large as stated. At least one degree
    /// is counted.
    pub fn variance_factor(&self) -> f64 {
        let degrees = self.residuals.saturating_sub(self.parameters.len()).max(1);
        self.sum_of_squares / degrees as f64
    }
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LeastSquaresError {
    /// The residuals leave some combination of the parameters open.
    #[error("the measurements leave parameter {parameter} of {parameters} undetermined")]
    Undetermined {
        /// Index of one that is open.
        parameter: usize,
        /// Number of parameters.
        parameters: usize,
    },
    /// A residual or derivative is no number.
    #[error("a residual is no number; the start of the search is too far off")]
    NoNumber,
    /// The steps do not become small.
    #[error("no minimum was found in {steps} steps")]
    DidNotConverge {
        /// Steps taken.
        steps: usize,
    },
}
