//! The map from the image to labels, which all views share except for an offset.

use epirig_core::statistics::median;
use nalgebra::{SMatrix, SVector};

use super::views::View;
use crate::target::BoardCorner;

/// Powers of x and y up to the third, without the constant: perspective, and a lens that bends lines.
const TERMS: usize = 9;
/// Rounds of reweighting; the weights converge in about five.
const ROUNDS: usize = 12;
/// A corner off by this much counts half, in squares.
const SCALE_SQUARES: f64 = 0.05;
/// Addend to the diagonal for each corner: terms that the corners do not determine become zero. Coordinates
/// are -1 to 1.
const RIDGE: f64 = 1e-7;

type Terms = SVector<f64, TERMS>;

/// Label less offset as a polynomial of the place in the image.
#[derive(Debug)]
pub(super) struct PlaneMap {
    middle: (f64, f64),
    half_size_px: f64,
    columns: Terms,
    rows: Terms,
}

impl PlaneMap {
    pub(super) fn new(views: &[View]) -> Self {
        let spread = |of: fn(&BoardCorner) -> f64| {
            let all = views.iter().flat_map(|view| &view.corners).map(of);
            all.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)))
        };
        let (x, y) = (spread(|corner| corner.corner.x_px), spread(|corner| corner.corner.y_px));
        let half_size_px = (0.5 * (x.1 - x.0).max(y.1 - y.0)).max(1.0);
        let middle = (0.5 * (x.0 + x.1), 0.5 * (y.0 + y.1));
        let mut map = Self { middle, half_size_px, columns: Terms::zeros(), rows: Terms::zeros() };
        let mut weights: Vec<Vec<f64>> = views.iter().map(|view| vec![1.0; view.corners.len()]).collect();
        for _ in 0..ROUNDS {
            if !map.fit(views, &weights) {
                break;
            }
            for (view, weights) in views.iter().zip(&mut weights) {
                let offset = map.offset(view);
                for (corner, weight) in view.corners.iter().zip(weights) {
                    let [column, row] = map.residual(corner, &offset);
                    *weight = 1.0 / (1.0 + (column * column + row * row) / SCALE_SQUARES.powi(2));
                }
            }
        }
        map
    }

    fn terms(&self, corner: &BoardCorner) -> Terms {
        let x = (corner.corner.x_px - self.middle.0) / self.half_size_px;
        let y = (corner.corner.y_px - self.middle.1) / self.half_size_px;
        Terms::from([x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y])
    }

    /// Least squares with the offset of each view eliminated; whether there is a solution.
    fn fit(&mut self, views: &[View], weights: &[Vec<f64>]) -> bool {
        let mut matrix = SMatrix::<f64, TERMS, TERMS>::zeros();
        let (mut columns, mut rows) = (Terms::zeros(), Terms::zeros());
        let mut count = 0.0;
        for (view, weights) in views.iter().zip(weights) {
            let total: f64 = weights.iter().sum();
            let (mut mean, mut column, mut row) = (Terms::zeros(), 0.0, 0.0);
            for (corner, &weight) in view.corners.iter().zip(weights) {
                mean += self.terms(corner) * (weight / total);
                column += f64::from(corner.column) * weight / total;
                row += f64::from(corner.row) * weight / total;
            }
            for (corner, &weight) in view.corners.iter().zip(weights) {
                let terms = self.terms(corner) - mean;
                matrix += terms * terms.transpose() * weight;
                columns += terms * (weight * (f64::from(corner.column) - column));
                rows += terms * (weight * (f64::from(corner.row) - row));
                count += weight;
            }
        }
        for k in 0..TERMS {
            matrix[(k, k)] += RIDGE * count;
        }
        let Some(factor) = matrix.cholesky() else { return false };
        (self.columns, self.rows) = (factor.solve(&columns), factor.solve(&rows));
        true
    }

    /// Label less the polynomial's value.
    fn difference(&self, corner: &BoardCorner) -> [f64; 2] {
        let terms = self.terms(corner);
        [f64::from(corner.column) - self.columns.dot(&terms), f64::from(corner.row) - self.rows.dot(&terms)]
    }

    /// The offset of a view: columns and rows. Medians, which a few false corners do not move.
    pub(super) fn offset(&self, view: &View) -> [f64; 2] {
        [0, 1].map(|axis| {
            let differences = view.corners.iter().map(|corner| self.difference(corner)[axis]);
            median(&mut differences.collect::<Vec<_>>()).unwrap_or(0.0)
        })
    }

    /// How far a corner is from where its view's offset has it, in squares.
    pub(super) fn residual(&self, corner: &BoardCorner, offset: &[f64; 2]) -> [f64; 2] {
        let difference = self.difference(corner);
        [difference[0] - offset[0], difference[1] - offset[1]]
    }
}
