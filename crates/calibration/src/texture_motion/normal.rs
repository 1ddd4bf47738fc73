//! The normal equations of all cameras, with the points eliminated.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, Vector2, Vector3};
use rayon::prelude::*;

use super::TextureMotionError;
use super::cameras::{Cameras, Point, View};
use super::fit::{Fit, LensPrior};
use super::model::{COMMON, FOCAL_LENGTH, K1, MotionModel, PAN};
use super::seen::Seen;
use super::track::Track;

/// Share of the trace that is added to the matrix of a point, so that those without parallax do no harm.
const POINT_DAMPING: f64 = 1e-7;
/// A frame whose pivot is less than this share of its diagonal is not connected with the others.
const PIVOT: f64 = 1e-11;

/// Sums of one track that all others do not change.
pub(super) struct Eliminated {
    /// Inverse of the point's matrix, and its right side.
    pub(super) inverse: Matrix3<f64>,
    pub(super) right: Vector3<f64>,
    /// Products of camera unknowns with those of the point.
    pub(super) mixed: Mixed,
}

/// Products of some camera unknowns with the three unknowns of a point.
pub(super) struct Mixed {
    /// Runs of unknowns that follow each other: the first of them, and where their products begin and end.
    runs: Vec<(usize, Range<usize>)>,
    products: [Vec<f64>; 3],
}

impl Mixed {
    fn of_common() -> Self {
        Self { runs: vec![(0, 0..COMMON)], products: [(); 3].map(|()| vec![0.0; COMMON]) }
    }

    /// Adds those of an unknown: one of the common ones, or one after all that are there.
    fn add(&mut self, index: usize, products: &Vector3<f64>) {
        if index < COMMON {
            (0..3).for_each(|axis| self.products[axis][index] += products[axis]);
            return;
        }
        let end = self.products[0].len();
        match self.runs.last_mut() {
            Some((first, places)) if *first + places.len() == index => places.end += 1,
            _ => self.runs.push((index, end..end + 1)),
        }
        (0..3).for_each(|axis| self.products[axis].push(products[axis]));
    }

    /// The sum of all products, each times the change of its unknown.
    pub(super) fn sum(&self, change: &DVector<f64>) -> Vector3<f64> {
        let changes = self.runs.iter().flat_map(|(first, places)| *first..first + places.len());
        let [x, y, z] = &self.products;
        let products = x.iter().zip(y).zip(z).map(|((x, y), z)| Vector3::new(*x, *y, *z));
        products.zip(changes).map(|(by, index)| by * change[index]).sum()
    }

    /// Takes all products with this change of the point off a sum by unknown.
    pub(super) fn take_off(&self, point: &Vector3<f64>, sum: &mut DVector<f64>) {
        let [x, y, z] = &self.products;
        for (first, places) in &self.runs {
            for (index, at) in (*first..).zip(places.clone()) {
                sum[index] -= x[at] * point.x + y[at] * point.y + z[at] * point.z;
            }
        }
    }

    /// Takes the point's part off the equations.
    fn eliminate(&self, inverse: &Matrix3<f64>, right: &Vector3<f64>, normal: &mut Normal) {
        let [x, y, z] = &self.products;
        for (run, (first, places)) in self.runs.iter().enumerate() {
            for (index, at) in (*first..).zip(places.clone()) {
                let solved = inverse * Vector3::new(x[at], y[at], z[at]);
                normal.right[index] -= solved.dot(right);
                let row = &mut normal.matrix[index * normal.count..][..normal.count];
                for (first, others) in &self.runs[..=run] {
                    // Of the lower triangle.
                    let others = others.start..others.end.min(at + 1);
                    let sums = &mut row[*first..][..others.len()];
                    let (x, y, z) = (&x[others.clone()], &y[others.clone()], &z[others]);
                    for (((sum, x), y), z) in sums.iter_mut().zip(x).zip(y).zip(z) {
                        *sum -= solved.x * x + solved.y * y + solved.z * z;
                    }
                }
            }
        }
    }
}

/// The reduced normal equations.
pub(super) struct Normal {
    count: usize,
    /// Lower triangle, row by row.
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl Normal {
    fn new(count: usize) -> Self {
        Self { count, matrix: vec![0.0; count * count], right: vec![0.0; count] }
    }

    fn plus(mut self, other: Self) -> Self {
        self.matrix.iter_mut().zip(&other.matrix).for_each(|(sum, value)| *sum += value);
        self.right.iter_mut().zip(&other.right).for_each(|(sum, value)| *sum += value);
        self
    }

    fn add(&mut self, row: usize, column: usize, value: f64) {
        self.matrix[row.max(column) * self.count + row.min(column)] += value;
    }
}

/// The equations of all tracks with their points eliminated.
pub(super) fn equations(tracks: &[Track], fit: &Fit) -> (Vec<Eliminated>, Normal) {
    let (views, free) = (fit.cameras.views(), fit.free);
    let count = free.unknowns(views.len());
    let parts: Vec<(Vec<Eliminated>, Normal)> = {
        let chunk = tracks.len().div_ceil(rayon::current_num_threads()).max(1);
        let of = |first: usize| {
            let mut normal = Normal::new(count);
            let last = (first + chunk).min(tracks.len());
            let eliminated = (first..last)
                .map(|index| {
                    let weights = &fit.weights[index];
                    eliminate(&tracks[index], &fit.points[index], weights, (&views, free), &mut normal)
                })
                .collect();
            (eliminated, normal)
        };
        (0..tracks.len()).step_by(chunk).collect::<Vec<_>>().into_par_iter().map(of).collect()
    };
    let mut all = Vec::with_capacity(tracks.len());
    let mut sum = Normal::new(count);
    for (eliminated, normal) in parts {
        all.extend(eliminated);
        sum = sum.plus(normal);
    }
    (all, sum)
}

/// Adds the equations of one track, without its point.
fn eliminate(
    track: &Track,
    point: &Point,
    weights: &[Vector2<f64>],
    (views, free): (&[View], MotionModel),
    normal: &mut Normal,
) -> Eliminated {
    let mut mixed = Mixed::of_common();
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (sight, &weight) in track.sights.iter().zip(weights).filter(|(_, weight)| weight.x > 0.0) {
        let Some(seen) = Seen::of(track, (sight, weight), &views[sight.frame], point, free) else { continue };
        let by_point = seen.point;
        matrix += by_point.transpose() * by_point;
        right += by_point.transpose() * seen.residual;
        let unknowns: Vec<(usize, Vector2<f64>)> = seen.unknowns(sight.frame, free).collect();
        for (at, (index, derivative)) in unknowns.iter().enumerate() {
            normal.right[*index] += derivative.dot(&seen.residual);
            unknowns[..=at].iter().for_each(|(other, by)| normal.add(*index, *other, derivative.dot(by)));
            mixed.add(*index, &(by_point.transpose() * derivative));
        }
    }
    matrix += Matrix3::identity() * (POINT_DAMPING * matrix.trace()).max(f64::MIN_POSITIVE);
    let inverse = matrix.try_inverse().unwrap_or_else(Matrix3::zeros);
    mixed.eliminate(&inverse, &right, normal);
    Eliminated { inverse, right, mixed }
}

/// The reduced normal equations, with ones on their diagonal, as a product of triangles.
pub(super) struct Solved {
    factor: Cholesky<f64, Dyn>,
    right: DVector<f64>,
    /// The unknowns that are not held, and the roots of their diagonal elements.
    kept: Vec<usize>,
    share: Vec<f64>,
    count: usize,
}

/// Unknowns that are held: the first frame, the one that is farthest from it, and what is not free.
fn held(cameras: &Cameras, free: MotionModel) -> Vec<usize> {
    let position = |frame: usize| cameras.frames[frame].position;
    let away = |frame: &usize| (position(*frame) - position(0)).abs();
    let frames = 0..cameras.frames.len();
    let farthest = frames.max_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(0);
    let mut held = vec![free.position(0), free.position(farthest)];
    held.extend((!free.pan).then_some(PAN));
    held.extend((!free.k1).then_some(K1));
    held.extend((!free.focal_length).then_some(FOCAL_LENGTH));
    held
}

impl Solved {
    pub(super) fn of(mut normal: Normal, fit: &Fit) -> Result<Self, TextureMotionError> {
        let (cameras, free) = (&fit.cameras, fit.free);
        for (index, value, sigma) in priors(fit) {
            normal.add(index, index, 1.0 / (sigma * sigma));
            normal.right[index] -= value / (sigma * sigma);
        }
        let count = normal.count;
        let held = held(cameras, free);
        let kept: Vec<usize> = (0..count).filter(|index| !held.contains(index)).collect();
        let value = |row: usize, column: usize| normal.matrix[row.max(column) * count + row.min(column)];
        let root = |&index: &usize| value(index, index).max(f64::MIN_POSITIVE).sqrt();
        let share: Vec<f64> = kept.iter().map(root).collect();
        let size = kept.len();
        let scaled = DMatrix::from_fn(size, size, |row, column| {
            value(kept[row], kept[column]) / (share[row] * share[column])
        });
        let all = || TextureMotionError::Apart { frames: (0..cameras.frames.len()).collect() };
        let factor = Cholesky::new(scaled).ok_or_else(all)?;
        let lower = factor.l_dirty();
        let frame_of = |index: usize| index.checked_sub(COMMON).map(|own| own / free.of_frame());
        let mut apart: Vec<usize> = (0..size)
            .filter(|&index| lower[(index, index)].powi(2) <= PIVOT)
            .filter_map(|index| frame_of(kept[index]))
            .collect();
        apart.dedup();
        if !apart.is_empty() {
            return Err(TextureMotionError::Apart { frames: apart });
        }
        let right = DVector::from_fn(size, |row, _| normal.right[kept[row]] / share[row]);
        Ok(Self { factor, right, kept, share, count })
    }

    /// The step of all unknowns, and its largest part in units of the unknown's standard deviation, the others held.
    pub(super) fn step(&self) -> (DVector<f64>, f64) {
        let solved = self.factor.solve(&self.right);
        let mut change = DVector::zeros(self.count);
        for ((&index, share), value) in self.kept.iter().zip(&self.share).zip(solved.iter()) {
            change[index] = value / share;
        }
        (change, solved.amax())
    }

    /// The inverse of the equations; zero for unknowns that are held.
    pub(super) fn inverse(&self) -> DMatrix<f64> {
        let scaled = self.factor.inverse();
        let mut inverse = DMatrix::zeros(self.count, self.count);
        for (row, &index) in self.kept.iter().enumerate() {
            for (column, &other) in self.kept.iter().enumerate() {
                inverse[(index, other)] = scaled[(row, column)] / (self.share[row] * self.share[column]);
            }
        }
        inverse
    }
}

/// Unknowns with a prior: index, by how much they depart from its mean, and its standard deviation.
pub(super) fn priors(fit: &Fit) -> Vec<(usize, f64, f64)> {
    let (LensPrior { focal_length_px, focal_length_sigma, k1_sigma }, free) = (fit.prior.lens, fit.free);
    let longer = (fit.cameras.focal_length_px / focal_length_px).ln();
    let focal_length = free.focal_length.then_some((FOCAL_LENGTH, longer, focal_length_sigma));
    let k1 = free.k1.then_some((K1, fit.cameras.k1, k1_sigma));
    let small = small_unknowns(fit).into_iter().map(|(index, value, _, sigma)| (index, value, sigma));
    focal_length.into_iter().chain(k1).chain(small).collect()
}

/// Rotations (0) and offsets (1): index, present value, kind, and standard deviation of the prior.
pub(super) fn small_unknowns(fit: &Fit) -> Vec<(usize, f64, usize, f64)> {
    let (free, [of_rotation, of_offset]) = (fit.free, fit.prior.small);
    let mut unknowns = Vec::new();
    for (frame, pose) in fit.cameras.frames.iter().enumerate() {
        if free.rotations {
            let first = free.position(frame) + 1;
            unknowns.extend((0..3).map(|axis| (first + axis, pose.rotation_rad[axis], 0, of_rotation)));
        }
        if free.offsets {
            let first = free.offset(frame);
            unknowns.extend((0..2).map(|axis| (first + axis, pose.offset[axis], 1, of_offset)));
        }
    }
    unknowns
}
