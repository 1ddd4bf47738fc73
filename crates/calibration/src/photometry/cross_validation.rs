//! Cross-validation of flat-field models: each is judged on frames, or on cells, that it was not fitted to.
//!
//! Let A and B be the means of two halves of the frames, with variances of noise s2 / a and s2 / b, and p_A
//! and p_B a model of each. Then ((B - p_A)^2 + (A - p_B)^2 - (A - B)^2) / 2 has as its expectation the
//! squared error of the model: what it cannot follow, and the noise that it has taken over. A map of the
//! means follows everything and has only the error of noise: s2 / (a + b), if it is made of all frames. That
//! error counts against it, because it stays in every frame as a fixed pattern.

use serde::{Deserialize, Serialize};

use super::grid::CellGrid;
use super::polynomial::{Cell, HIGHEST_ORDER, Polynomial};
use epirig_core::grid::Grid;
use epirig_core::statistics::mean;

/// Number of groups of cells; one group is left out at a time.
const FOLDS: usize = 5;

/// A model that takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TrialModel {
    /// A polynomial of this order.
    Polynomial(usize),
    /// The mean of every pixel.
    PerPixel,
}

/// The result of a model in cross-validation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trial {
    /// Which.
    pub model: TrialModel,
    /// Root mean square of its error, in % of the mean level: of all pixels if there are several frames, else
    /// of cells that were left out, including their noise. 0 if it is below the noise.
    pub error_percent: f64,
    /// How much larger its squared error is than that of the best, in standard errors of that difference over
    /// the cells.
    pub worse_by_sigmas: f64,
}

/// Means of two halves of the flat frames, each with mean 1.
pub(super) struct Halves {
    means: [Grid<f32>; 2],
    cells: [Vec<Cell>; 2],
    frames: [usize; 2],
}

impl Halves {
    /// From two means in DN, without outliers, of this number of frames each.
    pub(super) fn new(mut means: [Grid<f32>; 2], frames: [usize; 2]) -> Self {
        let cells = means.each_mut().map(|mean| {
            let grid = CellGrid::of(mean);
            let level = grid.mean();
            mean.values_mut().iter_mut().for_each(|value| *value /= level as f32);
            let mut cells = grid.cells().to_vec();
            cells.iter_mut().for_each(|cell| cell.mean /= level);
            cells
        });
        Self { means, cells, frames }
    }
}

/// A model with its squared errors in each cell.
type Errors = (TrialModel, Vec<f64>);

/// Models fitted to either half of the frames and judged on the other.
pub(super) fn trials_between_halves(halves: &Halves) -> Vec<Trial> {
    let [one, other] = &halves.means;
    // Mean over each cell of what `square` makes of the pixels' index.
    let over_cells = |square: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let of_cell = |cell: &Cell| {
            let pixels =
                cell.rows.clone().flat_map(|y| cell.columns.clone().map(move |x| y * one.columns() + x));
            pixels.map(square).sum::<f64>() / (cell.rows.len() * cell.columns.len()) as f64
        };
        halves.cells[0].iter().map(of_cell).collect()
    };
    let (a, b) = (one.values(), other.values());
    let difference = |index: usize| f64::from(a[index] - b[index]).powi(2);
    let mut errors: Vec<Errors> = (0..=HIGHEST_ORDER)
        .map_while(|order| {
            let fit = |cells: &[Cell]| Polynomial::fit(order, one.rows(), one.columns(), cells);
            let (of_a, of_b) = (fit(&halves.cells[0])?.image(), fit(&halves.cells[1])?.image());
            let (of_a, of_b) = (of_a.values(), of_b.values());
            let square = |index: usize| {
                let (b_left, a_left) = (f64::from(b[index] - of_a[index]), f64::from(a[index] - of_b[index]));
                0.5 * (b_left * b_left + a_left * a_left - difference(index))
            };
            Some((TrialModel::Polynomial(order), over_cells(&square)))
        })
        .collect();
    let [frames_a, frames_b] = halves.frames.map(|frames| frames as f64);
    let share = frames_a * frames_b / (frames_a + frames_b).powi(2);
    errors.push((TrialModel::PerPixel, over_cells(&|index| share * difference(index))));
    judge(&errors)
}

/// Polynomials fitted to four fifths of the cells and judged on the fifth, five times: for a single flat
/// frame. The cells that are left out together are scattered like knights on a chess-board.
pub(super) fn trials_over_cells(grid: &CellGrid, rows: usize, columns: usize) -> Vec<Trial> {
    let level = grid.mean();
    let cells = grid.cells();
    let across = grid.table(&vec![0.0; cells.len()]).first().map_or(1, Vec::len);
    let fold = |index: usize| (index % across + 2 * (index / across)) % FOLDS;
    let errors: Vec<Errors> = (0..=HIGHEST_ORDER)
        .map_while(|order| {
            let mut squares = vec![0.0; cells.len()];
            for left_out in 0..FOLDS {
                let seen = (0..cells.len()).filter(|&index| fold(index) != left_out);
                let seen: Vec<Cell> = seen.map(|index| cells[index].clone()).collect();
                let model = Polynomial::fit(order, rows, columns, &seen)?;
                for index in (0..cells.len()).filter(|&index| fold(index) == left_out) {
                    let cell = &cells[index];
                    let left = cell.mean - model.mean_over(&cell.columns, &cell.rows);
                    squares[index] = (left / level).powi(2);
                }
            }
            Some((TrialModel::Polynomial(order), squares))
        })
        .collect();
    judge(&errors)
}

/// Compares each model with the best, cell by cell.
fn judge(errors: &[Errors]) -> Vec<Trial> {
    let best = errors.iter().min_by(|one, other| mean(&one.1).total_cmp(&mean(&other.1)));
    let Some((_, best)) = best else { return Vec::new() };
    let trial = |(model, squares): &Errors| {
        let differences: Vec<f64> = squares.iter().zip(best).map(|(own, best)| own - best).collect();
        let worse = mean(&differences);
        let count = differences.len() as f64;
        let spread: f64 = differences.iter().map(|difference| (difference - worse).powi(2)).sum();
        let standard_error = (spread / (count * (count - 1.0).max(1.0))).sqrt();
        Trial {
            model: *model,
            error_percent: 100.0 * mean(squares).max(0.0).sqrt(),
            worse_by_sigmas: if worse > 0.0 { worse / standard_error.max(f64::MIN_POSITIVE) } else { 0.0 },
        }
    };
    errors.iter().map(trial).collect()
}

/// The first, hence simplest, whose error is larger than the best by no more than one standard error (the
/// rule of Breiman, Friedman, Olshen and Stone 1984).
pub(super) fn best(trials: &[Trial]) -> Option<TrialModel> {
    trials.iter().find(|trial| trial.worse_by_sigmas <= 1.0).map(|trial| trial.model)
}
