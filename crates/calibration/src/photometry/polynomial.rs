//! Two-dimensional polynomials over an image: smooth fields such as the vignetting of a lens.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use epirig_core::grid::Grid;

/// Highest total order that is supported: 45 coefficients, of which a grid of 10 x 10 cells leaves none open.
pub const HIGHEST_ORDER: usize = 8;

/// A diagonal element of R this much smaller than the largest is rounding: the places leave a coefficient
/// open. Order 8 over 10 x 10 cells has a ratio of about 1e-3.
const OPEN: f64 = 1e-9;

/// A polynomial of total order n: the sum of c_ij u^i v^j for i + j <= n, where u and v run from -1 in the
/// first to 1 in the last column and row.
///
/// Coefficients are sorted by total order, then by falling powers of u: 1, u, v, u2, uv, v2, ...
///
/// ```
/// use epirig_calibration::photometry::Polynomial;
///
/// // 1 + 0.5 u over 3 columns and 2 rows.
/// let slope = Polynomial::new(2, 3, vec![1.0, 0.5, 0.0]).unwrap();
/// assert_eq!((slope.order(), slope.at(0.0, 0.0), slope.at(2.0, 1.0)), (1, 0.5, 1.5));
/// assert_eq!(slope.mean(), 1.0);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written")]
pub struct Polynomial {
    rows: usize,
    columns: usize,
    coefficients: Vec<f64>,
}

/// A polynomial as a file holds it, where the number of coefficients may be wrong.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    rows: usize,
    columns: usize,
    coefficients: Vec<f64>,
}

impl TryFrom<Written> for Polynomial {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        let count = written.coefficients.len();
        Self::new(written.rows, written.columns, written.coefficients).ok_or_else(|| {
            format!(
                "{count} coefficients over {} x {} px are no polynomial of order 0 to {HIGHEST_ORDER}",
                written.columns, written.rows
            )
        })
    }
}

/// A rectangle of pixels with the mean of its values; for a single pixel, a place and its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Columns that it covers, not empty.
    pub columns: Range<usize>,
    /// Rows that it covers, not empty.
    pub rows: Range<usize>,
    /// Mean of its pixels, without defective ones.
    pub mean: f64,
    /// Pixels that count.
    pub pixels: usize,
}

impl Cell {
    /// The pixel in its middle: column and row.
    pub fn middle(&self) -> (usize, usize) {
        ((self.columns.start + self.columns.end - 1) / 2, (self.rows.start + self.rows.end - 1) / 2)
    }
}

/// Number of coefficients of an order.
fn terms(order: usize) -> usize {
    (order + 1) * (order + 2) / 2
}

/// Powers of u and v of all terms of an order.
fn powers(order: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..=order).flat_map(|total| (0..=total).map(move |j| (total - j, j)))
}

/// The coordinate in [-1, 1] of pixel `index` of `size`.
fn normalised(index: f64, size: usize) -> f64 {
    if size > 1 { 2.0 * index / (size - 1) as f64 - 1.0 } else { 0.0 }
}

/// Means of the powers 0 to `order` of the normalised coordinate over the pixels in `range`.
fn mean_powers(range: &Range<usize>, size: usize, order: usize) -> Vec<f64> {
    let mut sums = vec![0.0; order + 1];
    for index in range.clone() {
        let coordinate = normalised(index as f64, size);
        let mut power = 1.0;
        for sum in &mut sums {
            *sum += power;
            power *= coordinate;
        }
    }
    sums.iter().map(|sum| sum / range.len() as f64).collect()
}

impl Polynomial {
    /// Over an image of `rows` x `columns`; `None` if the image is empty, a coefficient is not finite, or
    /// their number is not that of an order from 0 to [`HIGHEST_ORDER`].
    pub fn new(rows: usize, columns: usize, coefficients: Vec<f64>) -> Option<Self> {
        let fits = (0..=HIGHEST_ORDER).any(|order| terms(order) == coefficients.len());
        let finite = coefficients.iter().all(|coefficient| coefficient.is_finite());
        (fits && finite && rows > 0 && columns > 0).then_some(Self { rows, columns, coefficients })
    }

    /// The polynomial of `order` whose means over `cells` have the least squared departures from theirs,
    /// over an image of `rows` x `columns`. Its own means are exact (the mean of a power over the pixels of a
    /// cell, not its value in the middle), so that a field that is such a polynomial is found as it is,
    /// however large the cells are.
    ///
    /// `None` if the cells leave a coefficient open, or the order is higher than [`HIGHEST_ORDER`].
    pub fn fit(order: usize, rows: usize, columns: usize, cells: &[Cell]) -> Option<Self> {
        let count = terms(order);
        if order > HIGHEST_ORDER || cells.len() < count {
            return None;
        }
        let mut matrix = DMatrix::zeros(cells.len(), count);
        for (row, cell) in cells.iter().enumerate() {
            let across = mean_powers(&cell.columns, columns, order);
            let down = mean_powers(&cell.rows, rows, order);
            for (term, (i, j)) in powers(order).enumerate() {
                matrix[(row, term)] = across[i] * down[j];
            }
        }
        let values = DVector::from_iterator(cells.len(), cells.iter().map(|cell| cell.mean));
        let decomposition = matrix.qr();
        let upper = decomposition.r();
        let diagonal = upper.diagonal().abs();
        if diagonal.min() <= OPEN * diagonal.max() {
            return None;
        }
        let right = decomposition.q().transpose() * values;
        let solution = upper.solve_upper_triangular(&right)?;
        Self::new(rows, columns, solution.as_slice().to_vec())
    }

    /// Total order.
    pub fn order(&self) -> usize {
        (0..=HIGHEST_ORDER).find(|&order| terms(order) == self.coefficients.len()).unwrap_or(0)
    }

    /// Rows of the image.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Columns of the image.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Coefficients by total order, then by falling powers of u.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// The value at column `x` and row `y`, which need not be whole.
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let (u, v) = (normalised(x, self.columns), normalised(y, self.rows));
        let terms = self.coefficients.iter().zip(powers(self.order()));
        terms.map(|(coefficient, (i, j))| coefficient * u.powi(i as i32) * v.powi(j as i32)).sum()
    }

    /// The mean over the pixels of a rectangle.
    pub fn mean_over(&self, columns: &Range<usize>, rows: &Range<usize>) -> f64 {
        let across = mean_powers(columns, self.columns, self.order());
        let down = mean_powers(rows, self.rows, self.order());
        self.coefficients.iter().zip(powers(self.order())).map(|(c, (i, j))| c * across[i] * down[j]).sum()
    }

    /// The mean over all pixels.
    pub fn mean(&self) -> f64 {
        self.mean_over(&(0..self.columns), &(0..self.rows))
    }

    /// The same times a factor.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        self.coefficients.iter_mut().for_each(|coefficient| *coefficient *= factor);
        self
    }

    /// The values at all pixels. For each row the powers of v are summed up once, so a pixel costs n
    /// multiplications.
    pub fn image(&self) -> Grid<f32> {
        let order = self.order();
        let across: Vec<f64> = (0..self.columns).map(|x| normalised(x as f64, self.columns)).collect();
        let mut image = Grid::filled(self.rows, self.columns, 0.0);
        let mut of_row = vec![0.0; order + 1];
        for y in 0..self.rows {
            let v = normalised(y as f64, self.rows);
            of_row.fill(0.0);
            for (coefficient, (i, j)) in self.coefficients.iter().zip(powers(order)) {
                of_row[i] += coefficient * v.powi(j as i32);
            }
            for (out, u) in image.row_mut(y).iter_mut().zip(&across) {
                *out = of_row.iter().rev().fold(0.0, |sum, coefficient| sum * u + coefficient) as f32;
            }
        }
        image
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pixels(rows: usize, columns: usize, value: impl Fn(f64, f64) -> f64) -> Vec<Cell> {
        (0..rows * columns)
            .map(|index| {
                let (x, y) = (index % columns, index / columns);
                Cell { columns: x..x + 1, rows: y..y + 1, mean: value(x as f64, y as f64), pixels: 1 }
            })
            .collect()
    }

    #[test]
    fn the_paper_s_polynomial_has_ten_coefficients() {
        assert_eq!((terms(0), terms(3), terms(HIGHEST_ORDER)), (1, 10, 45));
        assert_eq!(powers(2).collect::<Vec<_>>(), [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]);
    }

    #[test]
    fn a_known_field_has_known_coefficients() {
        // Columns 0 to 4 are u = -1, -0.5, 0, 0.5, 1; rows 0 to 2 are v = -1, 0, 1. The field is 7 + 3 u - 2
        // v + 4 u v.
        let field = |x: f64, y: f64| {
            let (u, v) = (x / 2.0 - 1.0, y - 1.0);
            7.0 + 3.0 * u - 2.0 * v + 4.0 * u * v
        };
        let found = Polynomial::fit(2, 3, 5, &pixels(3, 5, field)).unwrap();
        for (found, truth) in found.coefficients().iter().zip([7.0, 3.0, -2.0, 0.0, 4.0, 0.0]) {
            assert!((found - truth).abs() < 1e-12, "{found} {truth}");
        }
        assert!((found.mean() - 7.0).abs() < 1e-12);
    }

    #[test]
    fn too_few_places_are_no_polynomial() {
        assert_eq!(Polynomial::fit(1, 3, 3, &pixels(1, 2, |x, _| x)), None);
        // Nine places, but in one line.
        let line: Vec<Cell> =
            (0..9).map(|x| Cell { columns: x..x + 1, rows: 4..5, mean: x as f64, pixels: 1 }).collect();
        assert_eq!(Polynomial::fit(1, 9, 9, &line), None);
        assert_eq!(Polynomial::fit(HIGHEST_ORDER + 1, 20, 20, &pixels(20, 20, |x, _| x)), None);
        assert_eq!(Polynomial::new(2, 2, vec![0.0; 4]), None);
        assert_eq!(Polynomial::new(2, 2, vec![f64::NAN]), None);
    }

    #[test]
    fn a_file_with_a_wrong_number_of_coefficients_is_refused() {
        let good = Polynomial::new(4, 5, vec![1.0, 0.25, -0.1]).unwrap();
        let text = serde_json::to_string(&good).unwrap();
        assert_eq!(serde_json::from_str::<Polynomial>(&text).unwrap(), good);
        let error = serde_json::from_str::<Polynomial>(&text.replace("[1.0,", "["));
        assert!(error.unwrap_err().to_string().contains("2 coefficients over 5 x 4 px"));
    }

    proptest! {
        #[test]
        fn any_polynomial_is_found_from_means_over_cells(
            order in 0..=HIGHEST_ORDER, seed in proptest::collection::vec(-1.0..1.0_f64, 45),
            rows in 40_usize..130, columns in 40_usize..130,
        ) {
            let truth = Polynomial::new(rows, columns, seed[..terms(order)].to_vec()).unwrap();
            let cell = |index: usize, size: usize| index * size / 10..(index + 1) * size / 10;
            let cells: Vec<Cell> = (0..100)
                .map(|index| {
                    let (columns, rows) = (cell(index % 10, columns), cell(index / 10, rows));
                    let pixels = columns.len() * rows.len();
                    let sum: f64 = rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y)))
                        .map(|(x, y)| truth.at(x as f64, y as f64)).sum();
                    Cell { columns, rows, mean: sum / pixels as f64, pixels }
                })
                .collect();
            let found = Polynomial::fit(order, rows, columns, &cells).unwrap();
            for (found, truth) in found.coefficients().iter().zip(truth.coefficients()) {
                prop_assert!((found - truth).abs() < 1e-8, "{found} {truth}");
            }
            let image = found.image();
            for (x, y) in [(0, 0), (columns - 1, 0), (columns / 2, rows - 1), (columns / 3, rows / 2)] {
                // f32 at a value of up to 45.
                prop_assert!((f64::from(image.at(x, y)) - truth.at(x as f64, y as f64)).abs() < 4e-6);
            }
            let mean = image.values().iter().map(|&value| f64::from(value)).sum::<f64>() / (rows * columns) as f64;
            prop_assert!((found.mean() - mean).abs() < 1e-6);
        }
    }
}
