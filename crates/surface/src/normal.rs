//! Normal equations of few unknowns, to which observations can be added and from which they can be removed.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Number of coefficients of the longest form, a cubic.
pub(super) const MOST_TERMS: usize = 10;
/// These coefficients and a depth.
pub(super) const MOST: usize = MOST_TERMS + 1;

/// Sums over pixels, from which the best parameters follow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Normal {
    matrix: [[f64; MOST]; MOST],
    right: [f64; MOST],
    pub(super) pixels: usize,
}

/// The best parameters.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    pub(super) values: DVector<f64>,
    /// Inverse of the normal equations.
    pub(super) inverse: DMatrix<f64>,
}

impl Normal {
    pub(super) fn empty() -> Self {
        Self { matrix: [[0.0; MOST]; MOST], right: [0.0; MOST], pixels: 0 }
    }

    /// Adds a pixel: `value` is predicted as the product of `row` and the parameters. `row` has at most
    /// [`MOST`] elements.
    #[inline]
    pub(super) fn add(&mut self, row: &[f64], value: f64, weight: f64) {
        for (i, &element) in row.iter().enumerate() {
            let weighted = weight * element;
            self.right[i] += weighted * value;
            for (sum, &other) in self.matrix[i].iter_mut().zip(&row[..=i]) {
                *sum += weighted * other;
            }
        }
        self.pixels += 1;
    }

    /// Adds `factor` times the sums of other pixels: 1, or -1 to take them away.
    pub(super) fn accumulate(&mut self, other: &Self, factor: f64) {
        for i in 0..MOST {
            self.right[i] += factor * other.right[i];
            for j in 0..=i {
                self.matrix[i][j] += factor * other.matrix[i][j];
            }
        }
        self.pixels = self.pixels.saturating_add_signed(factor as isize * other.pixels as isize);
    }

    /// The matrix of the first `count` unknowns.
    pub(super) fn matrix(&self, count: usize) -> DMatrix<f64> {
        DMatrix::from_fn(count, count, |i, j| self.matrix[i.max(j)][i.min(j)])
    }

    /// The best values of the first `count` unknowns; `None` if they are not determined.
    pub(super) fn solve(&self, count: usize) -> Option<Solution> {
        let matrix = self.matrix(count);
        // With ones on the diagonal units do not matter, and a small pivot is an unknown that others can
        // stand in for.
        let scale = DVector::from_fn(count, |i, _| matrix[(i, i)].sqrt());
        let scaled = DMatrix::from_fn(count, count, |i, j| matrix[(i, j)] / (scale[i] * scale[j]));
        let factor = Cholesky::new(scaled)?;
        let lower = factor.l_dirty();
        // Double precision leaves 1e-16; beyond 1e-10 six of sixteen digits remain, a nanometre of a
        // millimetre.
        if (0..count).any(|i| lower[(i, i)].powi(2) < 1e-10) {
            return None;
        }
        let inverse = factor.inverse();
        let inverse = DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] / (scale[i] * scale[j]));
        let values = &inverse * DVector::from_fn(count, |i, _| self.right[i]);
        values.iter().all(|value| value.is_finite()).then_some(Solution { values, inverse })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_three_points() {
        // y = 1, 3, 4 at x = 0, 1, 2: slope 3/2, intercept 7/6 by hand.
        let mut sums = Normal::empty();
        for (x, y) in [(0.0, 1.0), (1.0, 3.0), (2.0, 4.0)] {
            sums.add(&[1.0, x], y, 1.0);
        }
        let found = sums.solve(2).unwrap();
        assert!((found.values[0] - 7.0 / 6.0).abs() < 1e-12 && (found.values[1] - 1.5).abs() < 1e-12);
        // The slope's variance is 1 / sum (x - mean)^2.
        assert!((found.inverse[(1, 1)] - 0.5).abs() < 1e-12);
        let mut first = Normal::empty();
        first.add(&[1.0, 0.0], 1.0, 1.0);
        sums.accumulate(&first, -1.0);
        assert_eq!(sums.pixels, 2);
        assert!((sums.solve(2).unwrap().values[1] - 1.0).abs() < 1e-9);
        assert!(first.solve(2).is_none());
    }
}
