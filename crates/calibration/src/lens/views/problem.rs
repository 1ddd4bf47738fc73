//! A lens and the poses of boards as parameters of one bundle adjustment.

use std::ops::Range;

use nalgebra::{Rotation3, Vector3};

use super::point::{PlanarPoint, View};
use super::pose::BoardPose;
use crate::lens::model::Lens;
use epirig_core::least_squares::{Block, Problem};

/// Numbers of a pose: rotation, translation.
const POSE: usize = 6;

/// Parameters: those of the lens that are estimated, then rotation and translation of each view's board.
pub(super) struct ViewsProblem {
    /// Has the values of the parameters that are not estimated.
    lens: Lens,
    estimated: Range<usize>,
    views: Vec<View>,
}

impl ViewsProblem {
    /// `estimated` are parameters of the lens by their index in [`Lens::to_array`].
    pub(super) fn new(lens: Lens, estimated: Range<usize>, views: Vec<View>) -> Self {
        Self { lens, estimated, views }
    }

    pub(super) fn parameters_of(&self, lens: &Lens, poses: &[BoardPose]) -> Vec<f64> {
        let lens = &lens.to_array()[self.estimated.clone()];
        let poses = poses.iter().flat_map(|pose| pose.rotation_rad.into_iter().chain(pose.translation_mm));
        lens.iter().copied().chain(poses).collect()
    }

    pub(super) fn lens(&self, parameters: &[f64]) -> Lens {
        let mut values = self.lens.to_array();
        values[self.estimated.clone()].copy_from_slice(&parameters[..self.estimated.len()]);
        Lens::from_array(values)
    }

    pub(super) fn poses(&self, parameters: &[f64]) -> Vec<BoardPose> {
        parameters[self.estimated.len()..].chunks_exact(POSE).map(pose).collect()
    }
}

fn pose(numbers: &[f64]) -> BoardPose {
    BoardPose {
        rotation_rad: std::array::from_fn(|axis| numbers[axis]),
        translation_mm: std::array::from_fn(|axis| numbers[3 + axis]),
    }
}

/// Residuals of a point and the derivatives of its prediction, both over its standard deviation; by the
/// estimated parameters of the lens, by a small further rotation, and by the translation.
fn point_block(
    lens: &Lens,
    estimated: &Range<usize>,
    turned: &Vector3<f64>,
    translation: &Vector3<f64>,
    point: &PlanarPoint,
) -> ([f64; 2], [[f64; Lens::PARAMETERS + POSE]; 2]) {
    let place = turned + translation;
    if place.z <= 0.0 {
        // Behind the camera nothing is seen: a step that leads there is not taken.
        return ([f64::NAN; 2], [[f64::NAN; Lens::PARAMETERS + POSE]; 2]);
    }
    let (a, b) = (place.x / place.z, place.y / place.z);
    let seen = lens.project(a, b);
    let weight = 1.0 / point.sigma_px;
    let row = |axis: usize| {
        let [by_a, by_b] = seen.by_ray[axis];
        let by_place = Vector3::new(by_a, by_b, -(by_a * a + by_b * b)) / place.z;
        // A small rotation w moves the turned point q by w x q, so the derivative by w is q x (derivative by
        // place).
        let by_rotation = turned.cross(&by_place);
        let mut row = [0.0; Lens::PARAMETERS + POSE];
        let derivatives =
            seen.by_lens[axis][estimated.clone()].iter().chain(by_rotation.iter()).chain(by_place.iter());
        row.iter_mut().zip(derivatives).for_each(|(out, derivative)| *out = weight * derivative);
        row
    };
    ([weight * (point.x_px - seen.x_px), weight * (point.y_px - seen.y_px)], [row(0), row(1)])
}

impl Problem for ViewsProblem {
    fn parameters(&self) -> usize {
        self.estimated.len() + POSE * self.views.len()
    }

    fn blocks(&self, parameters: &[f64], give: &mut dyn FnMut(Block<'_>)) {
        let lens = self.lens(parameters);
        let lens_count = self.estimated.len();
        let count = lens_count + POSE;
        for (index, (view, pose)) in self.views.iter().zip(self.poses(parameters)).enumerate() {
            let first = lens_count + POSE * index;
            let columns: Vec<usize> = (0..lens_count).chain(first..first + POSE).collect();
            let (rotation, translation) = (pose.rotation(), Vector3::from(pose.translation_mm));
            for point in view {
                let turned = rotation * Vector3::new(point.x_mm, point.y_mm, 0.0);
                let (residuals, [x, y]) = point_block(&lens, &self.estimated, &turned, &translation, point);
                let mut jacobian = [0.0; 2 * (Lens::PARAMETERS + POSE)];
                jacobian[..count].copy_from_slice(&x[..count]);
                jacobian[count..2 * count].copy_from_slice(&y[..count]);
                give(Block {
                    residuals: &residuals,
                    columns: &columns,
                    jacobian: &jacobian[..2 * count],
                    may_be_wrong: true,
                });
            }
        }
    }

    fn step(&self, parameters: &mut [f64], step: &[f64]) {
        let lens = self.estimated.len();
        parameters[..lens].iter_mut().zip(step).for_each(|(parameter, step)| *parameter += step);
        for (numbers, step) in parameters[lens..].chunks_exact_mut(POSE).zip(step[lens..].chunks_exact(POSE))
        {
            let [turn, turned] =
                [step, &*numbers].map(|vector| Rotation3::new(Vector3::from_column_slice(&vector[..3])));
            numbers[..3].copy_from_slice((turn * turned).scaled_axis().as_slice());
            numbers[3..].iter_mut().zip(&step[3..]).for_each(|(number, step)| *number += step);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_agree_with_differences() {
        let lens = Lens::from_array([800.0, 790.0, 321.0, 243.0, -0.2, 0.1, 0.003, -0.002, 0.05]);
        let point = PlanarPoint { x_mm: 30.0, y_mm: -20.0, x_px: 300.0, y_px: 250.0, sigma_px: 0.5 };
        let problem = ViewsProblem::new(lens, 0..9, vec![vec![point]]);
        let pose = BoardPose { rotation_rad: [0.3, -0.5, 1.0], translation_mm: [10.0, 20.0, 400.0] };
        let start = problem.parameters_of(&lens, &[pose]);
        let residuals = |step: &[f64]| {
            let mut at = start.clone();
            problem.step(&mut at, step);
            let mut found = Vec::new();
            problem.blocks(&at, &mut |block| found.extend_from_slice(block.residuals));
            found
        };
        let mut jacobian = Vec::new();
        problem.blocks(&start, &mut |block| jacobian.extend_from_slice(block.jacobian));
        for parameter in 0..15 {
            let size = 1e-6 * start[parameter].abs().max(1.0);
            let step = |sign: f64| {
                let mut step = vec![0.0; 15];
                step[parameter] = sign * size;
                residuals(&step)
            };
            let (ahead, back) = (step(1.0), step(-1.0));
            for axis in 0..2 {
                let difference = -(ahead[axis] - back[axis]) / (2.0 * size);
                let found = jacobian[15 * axis + parameter];
                assert!(
                    (found - difference).abs() < 1e-5 * (1.0 + difference.abs()),
                    "{parameter} {axis}: {found} {difference}"
                );
            }
        }
    }
}
