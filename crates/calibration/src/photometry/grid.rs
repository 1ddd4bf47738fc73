//! Means over a regular grid of cells, the paper's 10 x 10.

use std::ops::Range;

use super::polynomial::{Cell, Polynomial};
use epirig_core::grid::Grid;
use epirig_core::statistics::{SIGMA_OF_MEDIAN_4, upper_median};

/// Cells across and down, as in the paper. Smaller images have a cell for each pixel.
const CELLS: usize = 10;
/// Pixels that deviate by more than this many robust standard deviations from their cell's median do not
/// count. Within a cell vignetting is a ramp. The median absolute deviation of a ramp is a quarter of its
/// height, so the limit lies 1.9 times its height to either side, and a ramp is never cut. Of Gaussian noise
/// one in two million is lost, on either side alike.
const CUT: f64 = 5.0;
/// Where most pixels of a cell have one value, the standard deviation is taken to be this, in units of the
/// image: half a DN.
const LEAST_SIGMA: f64 = 0.5;

/// An image's means over 10 x 10 cells that cover it, each as large as the others to a pixel.
///
/// ```
/// use epirig_calibration::photometry::CellGrid;
/// use epirig_core::grid::Grid;
///
/// let mut image = Grid::filled(100, 200, 80.0);
/// image.row_mut(5)[5] = 255.0;
/// let grid = CellGrid::of(&image);
/// assert_eq!((grid.cells().len(), grid.cells()[0].mean, grid.cells()[0].pixels), (100, 80.0, 199));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CellGrid {
    across: usize,
    cells: Vec<Cell>,
}

/// Ranges that part `size` pixels into cells.
fn parts(size: usize) -> impl Iterator<Item = Range<usize>> + Clone {
    let count = size.min(CELLS);
    (0..count).map(move |index| index * size / count..(index + 1) * size / count)
}

impl CellGrid {
    /// The means over the cells of an image in DN.
    pub fn of(image: &Grid<f32>) -> Self {
        Self::with(image, mean_without_outliers)
    }

    /// With all pixels: means that do not jump where an edge crosses a cell, so that frames can be compared.
    pub(super) fn of_all_pixels(image: &Grid<f32>) -> Self {
        Self::with(image, |values| {
            let sum: f64 = values.iter().map(|&value| f64::from(value)).sum();
            (sum / values.len() as f64, values.len())
        })
    }

    fn with(image: &Grid<f32>, mean_of: impl Fn(&mut [f32]) -> (f64, usize)) -> Self {
        let columns = parts(image.columns());
        let mut values = Vec::new();
        let cells =
            parts(image.rows()).flat_map(|rows| columns.clone().map(move |columns| (columns, rows.clone())));
        let cells = cells
            .map(|(columns, rows)| {
                values.clear();
                rows.clone().for_each(|y| values.extend_from_slice(&image.row(y)[columns.clone()]));
                let (mean, pixels) = mean_of(&mut values);
                Cell { columns, rows, mean, pixels }
            })
            .collect();
        Self { across: parts(image.columns()).count(), cells }
    }

    /// The cells, row by row.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Mean over the cells.
    pub fn mean(&self) -> f64 {
        self.cells.iter().map(|cell| cell.mean).sum::<f64>() / self.cells.len().max(1) as f64
    }

    /// Residual of each cell against `model`, as a share of the model there, row by row.
    pub fn residuals(&self, model: &Polynomial) -> Vec<f64> {
        let share = |cell: &Cell| cell.mean / model.mean_over(&cell.columns, &cell.rows) - 1.0;
        self.cells.iter().map(share).collect()
    }

    /// Values of the cells as a table: a list for each row of cells.
    pub fn table(&self, of_cells: &[f64]) -> Vec<Vec<f64>> {
        of_cells.chunks(self.across.max(1)).map(<[f64]>::to_vec).collect()
    }
}

/// Mean and number of the values that lie within the cut around their median; NaN and 0 for no values.
fn mean_without_outliers(values: &mut [f32]) -> (f64, usize) {
    let Some(median) = upper_median(values) else { return (f64::NAN, 0) };
    let mut departures: Vec<f32> = values.iter().map(|value| (value - median).abs()).collect();
    let typical = upper_median(&mut departures).map_or(0.0, f64::from);
    let limit = CUT * (SIGMA_OF_MEDIAN_4 * typical).max(LEAST_SIGMA);
    let kept = values
        .iter()
        .map(|&value| f64::from(value))
        .filter(|value| (value - f64::from(median)).abs() <= limit);
    let (sum, count) = kept.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    (sum / count as f64, count)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn cells_cover_every_pixel_once(rows in 1_usize..70, columns in 1_usize..70) {
            let grid = CellGrid::of(&Grid::filled(rows, columns, 3.0));
            let mut seen = Grid::filled(rows, columns, 0);
            for cell in grid.cells() {
                prop_assert!(!cell.rows.is_empty() && !cell.columns.is_empty());
                for y in cell.rows.clone() {
                    seen.row_mut(y)[cell.columns.clone()].iter_mut().for_each(|count| *count += 1);
                }
            }
            prop_assert!(seen.values().iter().all(|&count| count == 1));
            prop_assert_eq!(grid.cells().len(), rows.min(10) * columns.min(10));
            let table = grid.table(&grid.cells().iter().map(|cell| cell.mean).collect::<Vec<_>>());
            prop_assert_eq!((table.len(), table[0].len()), (rows.min(10), columns.min(10)));
        }
    }

    #[test]
    fn a_ramp_is_not_cut_and_hot_pixels_are() {
        let mut ramp: Vec<f32> = (0..100).map(|value| value as f32).collect();
        assert_eq!(mean_without_outliers(&mut ramp), (49.5, 100));
        let mut with_hot: Vec<f32> = (0..100).map(|value| value as f32).chain([4000.0, 4095.0]).collect();
        let (mean, count) = mean_without_outliers(&mut with_hot);
        assert_eq!((mean, count), (49.5, 100));
        assert!(mean_without_outliers(&mut []).0.is_nan());
    }

    #[test]
    fn residuals_are_shares_of_the_model() {
        let grid = CellGrid::of(&Grid::filled(20, 20, 102.0));
        let model = Polynomial::new(20, 20, vec![100.0]).unwrap();
        assert!(grid.residuals(&model).iter().all(|share| (share - 0.02).abs() < 1e-12));
    }
}
