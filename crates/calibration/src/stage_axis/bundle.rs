//! Bundle adjustment of lens, stage axis, points and positions together.

use nalgebra::{DMatrix, DVector};

use super::Direction;
use crate::lens::{Lens, LensEstimate};
use crate::target::Observation;
use epirig_core::least_squares::{Block, Problem};

/// Parameters of a point: rectified x and y of its ray in the frame at tau = 0, and its disparity, all over
/// the focal length.
pub(super) const OF_POINT: usize = 3;
/// The angles.
const ANGLES: usize = 2;
/// Parameters on which one observation depends, at most.
const OF_OBSERVATION: usize = Lens::PARAMETERS + ANGLES + OF_POINT + 1;

/// Rigid target, straight axis, free position of every frame (but two, which fix the scale).
pub(super) struct Bundle<'a> {
    pub(super) observations: &'a [Observation],
    /// Which observations count.
    pub(super) used: &'a [bool],
    /// Factor of the standard deviations of the observations.
    pub(super) noise: f64,
    pub(super) lens: &'a LensEstimate,
    prior: Prior,
    pub(super) points: usize,
    /// Known beforehand of every frame, from the stage.
    tau: &'a [f64],
    /// How far that may be off, as a standard deviation.
    tau_sigma: f64,
    /// The place of each frame's tau among the parameters; `None` for those that are held or never seen.
    pub(super) tau_column: Vec<Option<usize>>,
}

/// The prior of the lens.
struct Prior {
    /// Parameters that are not held, in the order of [`Lens::to_array`].
    free: Vec<usize>,
    /// Square root of the inverse of their covariance.
    whitening: DMatrix<f64>,
}

impl<'a> Bundle<'a> {
    /// `None` if the lens's covariance is not one.
    pub(super) fn new(
        observations: &'a [Observation],
        used: &'a [bool],
        lens: &'a LensEstimate,
        points: usize,
        (tau, tau_sigma): (&'a [f64], f64),
    ) -> Option<Self> {
        let free: Vec<usize> =
            (0..Lens::PARAMETERS).filter(|&index| lens.covariance[index][index] > 0.0).collect();
        let covariance =
            DMatrix::from_fn(free.len(), free.len(), |row, column| lens.covariance[free[row]][free[column]]);
        let whitening = if free.is_empty() {
            DMatrix::zeros(0, 0)
        } else {
            covariance.cholesky()?.inverse().cholesky()?.l().transpose()
        };
        let mut seen = vec![false; tau.len()];
        observations
            .iter()
            .zip(used)
            .filter(|(_, used)| **used)
            .for_each(|(seen_at, _)| seen[seen_at.frame] = true);
        let held = [seen.iter().position(|seen| *seen)?, seen.iter().rposition(|seen| *seen)?];
        let mut next = free.len() + ANGLES + OF_POINT * points;
        let tau_column = (0..tau.len())
            .map(|frame| {
                let is_free = seen[frame] && !held.contains(&frame);
                is_free.then(|| {
                    next += 1;
                    next - 1
                })
            })
            .collect();
        let prior = Prior { free, whitening };
        Some(Self { observations, used, noise: 1.0, lens, prior, points, tau, tau_sigma, tau_column })
    }

    pub(super) fn angle_column(&self) -> usize {
        self.prior.free.len()
    }

    pub(super) fn point_column(&self, point: usize) -> usize {
        self.angle_column() + ANGLES + OF_POINT * point
    }

    /// Where the search begins.
    pub(super) fn start(&self, direction: Direction, points: &[[f64; OF_POINT]]) -> Vec<f64> {
        let lens = self.lens.lens.to_array();
        let mut start: Vec<f64> = self.prior.free.iter().map(|&index| lens[index]).collect();
        start.extend([direction.roll_rad, direction.pan_rad]);
        start.extend(points.iter().flatten());
        start.extend(
            self.tau_column.iter().zip(self.tau).filter(|(column, _)| column.is_some()).map(|(_, tau)| tau),
        );
        start
    }

    pub(super) fn lens_at(&self, parameters: &[f64]) -> Lens {
        let mut lens = self.lens.lens.to_array();
        self.prior.free.iter().zip(parameters).for_each(|(&index, value)| lens[index] = *value);
        Lens::from_array(lens)
    }

    pub(super) fn direction_at(&self, parameters: &[f64]) -> Direction {
        let column = self.angle_column();
        Direction { roll_rad: parameters[column], pan_rad: parameters[column + 1] }
    }

    pub(super) fn tau_at(&self, parameters: &[f64], frame: usize) -> f64 {
        self.tau_column[frame].map_or(self.tau[frame], |column| parameters[column])
    }

    /// The lens with its covariance after the least squares.
    pub(super) fn lens_estimate(&self, parameters: &[f64], covariance: &DMatrix<f64>) -> LensEstimate {
        let mut estimate = LensEstimate { lens: self.lens_at(parameters), ..self.lens.clone() };
        for (row, &i) in self.prior.free.iter().enumerate() {
            for (column, &j) in self.prior.free.iter().enumerate() {
                estimate.covariance[i][j] = covariance[(row, column)];
            }
        }
        estimate
    }

    /// Measured less predicted place of an observation, in px.
    pub(super) fn residual(&self, parameters: &[f64], seen: &Observation) -> [f64; 2] {
        let [x, y, disparity] = self.point_at(parameters, seen.corner);
        let ray =
            self.direction_at(parameters).raw(x + disparity * self.tau_at(parameters, seen.frame), y).ray;
        let (x_px, y_px) = self.lens_at(parameters).pixel(ray[0], ray[1]);
        [seen.x_px - x_px, seen.y_px - y_px]
    }

    pub(super) fn point_at(&self, parameters: &[f64], point: usize) -> [f64; OF_POINT] {
        let column = self.point_column(point);
        [parameters[column], parameters[column + 1], parameters[column + 2]]
    }

    fn give_prior(&self, parameters: &[f64], give: &mut dyn FnMut(Block<'_>)) {
        let free = &self.prior.free;
        if !free.is_empty() {
            let known = self.lens.lens.to_array();
            let off = DVector::from_iterator(
                free.len(),
                free.iter().zip(parameters).map(|(&index, value)| known[index] - value),
            );
            let residuals = &self.prior.whitening * off;
            let columns: Vec<usize> = (0..free.len()).collect();
            // Row by row, as blocks are.
            let jacobian = self.prior.whitening.transpose();
            give(Block {
                residuals: residuals.as_slice(),
                columns: &columns,
                jacobian: jacobian.as_slice(),
                may_be_wrong: false,
            });
        }
        for (column, tau) in self.tau_column.iter().zip(self.tau) {
            if let Some(column) = *column {
                give(Block {
                    residuals: &[(tau - parameters[column]) / self.tau_sigma],
                    columns: &[column],
                    jacobian: &[1.0 / self.tau_sigma],
                    may_be_wrong: false,
                });
            }
        }
    }
}

impl Problem for Bundle<'_> {
    fn parameters(&self) -> usize {
        self.point_column(self.points) + self.tau_column.iter().flatten().count()
    }

    fn blocks(&self, parameters: &[f64], give: &mut dyn FnMut(Block<'_>)) {
        self.give_prior(parameters, give);
        let (lens, direction) = (self.lens_at(parameters), self.direction_at(parameters));
        let angles = self.angle_column();
        let mut columns: Vec<usize> = Vec::with_capacity(OF_OBSERVATION);
        let mut jacobian: Vec<f64> = Vec::with_capacity(2 * OF_OBSERVATION);
        for (seen, _) in self.observations.iter().zip(self.used).filter(|(_, used)| **used) {
            let [x, y, disparity] = self.point_at(parameters, seen.corner);
            let tau = self.tau_at(parameters, seen.frame);
            let raw = direction.raw(x + disparity * tau, y);
            let seen_at = lens.project(raw.ray[0], raw.ray[1]);
            let point = self.point_column(seen.corner);
            columns.clear();
            columns.extend(0..self.prior.free.len());
            columns.extend([angles, angles + 1, point, point + 1, point + 2]);
            columns.extend(self.tau_column[seen.frame]);
            let scale = 1.0 / (self.noise * seen.sigma_px);
            jacobian.clear();
            for axis in 0..2 {
                let by_ray = seen_at.by_ray[axis];
                let chained = |index: usize| {
                    by_ray[0] * raw.derivatives[0][index] + by_ray[1] * raw.derivatives[1][index]
                };
                let (by_x, by_y) = (chained(2), chained(3));
                jacobian.extend(self.prior.free.iter().map(|&index| scale * seen_at.by_lens[axis][index]));
                jacobian.extend([chained(0), chained(1), by_x, by_y, tau * by_x].map(|value| scale * value));
                if self.tau_column[seen.frame].is_some() {
                    jacobian.push(scale * disparity * by_x);
                }
            }
            let residuals = [scale * (seen.x_px - seen_at.x_px), scale * (seen.y_px - seen_at.y_px)];
            give(Block { residuals: &residuals, columns: &columns, jacobian: &jacobian, may_be_wrong: true });
        }
    }
}
