//! Damped Gauss-Newton steps on dense normal equations.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::{Block, LeastSquaresError, Loss, Minimum, Problem};

/// Steps after which a search is given up. Ten are enough where the residuals are errors of measurement;
/// where they are those of a model that does not fit, Gauss-Newton steps converge slowly, and two hundred
/// have been seen.
const STEPS: usize = 1000;
/// A step that would lessen the sum of squares by less than this share of it changes nothing that is known.
const CONVERGED: f64 = 1e-12;
/// The same, absolute and for each residual: 1e-8 standard deviations, squared. Residuals that small are
/// rounding, of which no share is to be had.
const NOTHING: f64 = 1e-16;
/// A pivot this much smaller than its diagonal element is rounding: the parameter depends on those before it.
const PIVOT: f64 = 1e-13;

struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    sum_of_squares: f64,
    /// The robust loss of the residuals: it decides whether a step is an improvement.
    loss: f64,
    residuals: usize,
}

fn weight_and_loss(block: &Block<'_>, loss: Loss) -> (f64, f64) {
    let squares: f64 = block.residuals.iter().map(|residual| residual * residual).sum();
    match loss {
        Loss::Huber(limit) if block.may_be_wrong && squares > limit * limit => {
            let norm = squares.sqrt();
            (limit / norm, limit * (2.0 * norm - limit))
        }
        _ => (1.0, squares),
    }
}

fn normal(problem: &dyn Problem, parameters: &[f64], loss: Loss) -> Normal {
    let count = parameters.len();
    let mut normal = Normal {
        matrix: DMatrix::zeros(count, count),
        right: DVector::zeros(count),
        sum_of_squares: 0.0,
        loss: 0.0,
        residuals: 0,
    };
    problem.blocks(parameters, &mut |block| {
        let (weight, lost) = weight_and_loss(&block, loss);
        normal.loss += lost;
        normal.residuals += block.residuals.len();
        for (residual, row) in block.residuals.iter().zip(block.jacobian.chunks_exact(block.columns.len())) {
            normal.sum_of_squares += weight * residual * residual;
            for (&i, derivative) in block.columns.iter().zip(row) {
                let weighted = weight * derivative;
                normal.right[i] += weighted * residual;
                for (&j, other) in block.columns.iter().zip(row) {
                    normal.matrix[(i, j)] += weighted * other;
                }
            }
        }
    });
    normal
}

fn loss_at(problem: &dyn Problem, parameters: &[f64], loss: Loss) -> f64 {
    let mut sum = 0.0;
    problem.blocks(parameters, &mut |block| sum += weight_and_loss(&block, loss).1);
    sum
}

/// The parameters for which the residuals are smallest, from `start` on.
///
/// # Errors
/// [`LeastSquaresError`] if they are not determined, no numbers, or not found.
///
/// ```
/// use epirig_core::least_squares::{Block, Loss, Problem, minimise};
///
/// /// The mean of some numbers.
/// struct Mean([f64; 4]);
///
/// impl Problem for Mean {
///     fn parameters(&self) -> usize {
///         1
///     }
///     fn blocks(&self, at: &[f64], give: &mut dyn FnMut(Block<'_>)) {
///         for number in self.0 {
///             give(Block { residuals: &[number - at[0]], columns: &[0], jacobian: &[1.0], may_be_wrong: true });
///         }
///     }
/// }
///
/// let found = minimise(&Mean([1.0, 2.0, 3.0, 6.0]), vec![0.0], Loss::Squares)?;
/// assert!((found.parameters[0] - 3.0).abs() < 1e-9);
/// assert!((found.covariance[(0, 0)] - 0.25).abs() < 1e-12);
/// # Ok::<(), epirig_core::least_squares::LeastSquaresError>(())
/// ```
pub fn minimise(problem: &dyn Problem, start: Vec<f64>, loss: Loss) -> Result<Minimum, LeastSquaresError> {
    let mut parameters = start;
    let mut damping = 1e-4;
    let mut current = normal(problem, &parameters, loss);
    for steps in 1..=STEPS {
        if !(current.loss.is_finite() && current.matrix.iter().all(|value| value.is_finite())) {
            return Err(LeastSquaresError::NoNumber);
        }
        if let Some(parameter) = undetermined(&current.matrix) {
            return Err(LeastSquaresError::Undetermined { parameter, parameters: parameters.len() });
        }
        let mut damped = current.matrix.clone();
        for index in 0..parameters.len() {
            damped[(index, index)] *= 1.0 + damping;
        }
        let Some(factor) = Cholesky::new(damped) else {
            damping *= 10.0;
            continue;
        };
        let step = factor.solve(&current.right);
        let promised = step.dot(&current.right);
        let mut next = parameters.clone();
        problem.step(&mut next, step.as_slice());
        let next_loss = loss_at(problem, &next, loss);
        let small = promised <= CONVERGED * current.loss + NOTHING * current.residuals as f64;
        if next_loss <= current.loss {
            parameters = next;
            current = normal(problem, &parameters, loss);
            damping = (damping / 10.0).max(1e-12);
        } else {
            damping *= 10.0;
        }
        if small {
            let covariance = Cholesky::new(current.matrix)
                .ok_or(LeastSquaresError::Undetermined { parameter: 0, parameters: parameters.len() })?
                .inverse();
            let (sum_of_squares, residuals) = (current.sum_of_squares, current.residuals);
            return Ok(Minimum { parameters, covariance, sum_of_squares, residuals, steps });
        }
    }
    Err(LeastSquaresError::DidNotConverge { steps: STEPS })
}

/// The first parameter that those before it leave open, by the pivots of a Cholesky decomposition.
fn undetermined(matrix: &DMatrix<f64>) -> Option<usize> {
    let count = matrix.nrows();
    // The decomposition is of the matrix with ones on its diagonal, so that units do not matter.
    let scale: Vec<f64> = (0..count).map(|index| matrix[(index, index)].sqrt()).collect();
    if let Some(index) = scale.iter().position(|scale| *scale == 0.0) {
        return Some(index);
    }
    let scaled =
        DMatrix::from_fn(count, count, |row, column| matrix[(row, column)] / (scale[row] * scale[column]));
    match Cholesky::new(scaled.clone()) {
        Some(factor) => {
            let lower = factor.l_dirty();
            (0..count).find(|&index| lower[(index, index)] * lower[(index, index)] < PIVOT)
        }
        None => (1..=count)
            .find(|&size| Cholesky::new(scaled.view((0, 0), (size, size)).into_owned()).is_none())
            .map(|size| size - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y = a exp(b x) at given points, with `wrong` added to the last.
    struct Growth {
        wrong: f64,
    }

    impl Problem for Growth {
        fn parameters(&self) -> usize {
            2
        }

        fn blocks(&self, at: &[f64], give: &mut dyn FnMut(Block<'_>)) {
            for index in 0..20 {
                let x = f64::from(index) * 0.1;
                let truth = 3.0 * (0.7 * x).exp() + if index == 19 { self.wrong } else { 0.0 };
                let growth = (at[1] * x).exp();
                give(Block {
                    residuals: &[truth - at[0] * growth],
                    columns: &[0, 1],
                    jacobian: &[growth, at[0] * x * growth],
                    may_be_wrong: true,
                });
            }
        }
    }

    #[test]
    fn finds_the_parameters_of_a_curve() {
        let found = minimise(&Growth { wrong: 0.0 }, vec![1.0, 0.0], Loss::Squares).unwrap();
        assert!((found.parameters[0] - 3.0).abs() < 1e-7 && (found.parameters[1] - 0.7).abs() < 1e-7);
        assert_eq!(found.residuals, 20);
    }

    #[test]
    fn one_wrong_point_matters_less_with_a_robust_loss() {
        let squares = minimise(&Growth { wrong: 5.0 }, vec![1.0, 0.0], Loss::Squares).unwrap();
        let robust = minimise(&Growth { wrong: 5.0 }, vec![1.0, 0.0], Loss::Huber(0.01)).unwrap();
        let miss = |found: &Minimum| (found.parameters[1] - 0.7).abs();
        assert!(miss(&squares) > 0.05, "{squares:?}");
        assert!(miss(&robust) < 0.01, "{robust:?}");
    }

    /// Two parameters of which only the sum is measured.
    struct Sum;

    impl Problem for Sum {
        fn parameters(&self) -> usize {
            2
        }

        fn blocks(&self, at: &[f64], give: &mut dyn FnMut(Block<'_>)) {
            for number in [1.0, 2.0] {
                let residuals = [number - at[0] - at[1]];
                give(Block {
                    residuals: &residuals,
                    columns: &[0, 1],
                    jacobian: &[1.0, 1.0],
                    may_be_wrong: true,
                });
            }
        }
    }

    #[test]
    fn what_is_not_determined_is_refused() {
        let found = minimise(&Sum, vec![0.0, 0.0], Loss::Squares);
        assert_eq!(found, Err(LeastSquaresError::Undetermined { parameter: 1, parameters: 2 }));
    }
}
