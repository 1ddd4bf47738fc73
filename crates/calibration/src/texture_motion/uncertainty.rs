//! What is known of the cameras after the adjustment, and how well.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector2};

use super::cameras::{Point, View};
use super::fit::Fit;
use super::model::{FOCAL_LENGTH, K1, MotionModel};
use super::normal::{Eliminated, equations, priors};
use super::seen::Seen;
use super::track::Track;
use epirig_core::statistics::median;

/// Bias of a place between pixels by the cubic B-spline, root mean square over all places: its worst for texture
/// blurred by 0.7 px is 0.0016 px, and it goes up and down once a pixel, as a sine does. All points at one depth
/// have it in common, so it does not average out.
const INTERPOLATION_BIAS_PX: f64 = 0.0016 * std::f64::consts::FRAC_1_SQRT_2;
/// Points and frames in which rows are judged, at most.
const JUDGED: usize = 40;

/// The covariance of the camera unknowns.
pub(super) struct Uncertainty<'a> {
    fit: &'a Fit,
    /// By the scatter between cells of the scene and between frames, and by the residuals as independent noise.
    covariances: [DMatrix<f64>; 2],
    /// Inverse depth of a typical point, and how far it moves from one end of the path to the other, in px.
    rho: f64,
}

type Terms = Vec<(usize, f64)>;

impl<'a> Uncertainty<'a> {
    pub(super) fn of(tracks: &[Track], fit: &'a Fit) -> Self {
        let scores = scores(tracks, fit);
        let count = fit.inverse.nrows();
        let sum = |scores: &mut dyn Iterator<Item = &DVector<f64>>| {
            let mut sum = DMatrix::zeros(count, count);
            scores.for_each(|score| sum.ger(1.0, score, score, 1.0));
            sum
        };
        let cells = scores.cells.len() as f64;
        let mut middle = sum(&mut scores.cells.values()) * (cells / (cells - 1.0).max(1.0));
        if !fit.free.rotations {
            // What all points of a frame have in common is no noise of points. Rotations take it up.
            middle += sum(&mut scores.frames.iter());
        }
        for (index, _, sigma) in priors(fit) {
            middle[(index, index)] += 1.0 / (sigma * sigma);
        }
        let scattered = &fit.inverse * middle * &fit.inverse;
        Self { fit, covariances: [scattered, fit.inverse.clone()], rho: typical_rho(fit) }
    }

    /// Inverse depth of a typical point, in 1 / length of the path.
    pub(super) fn typical_rho(&self) -> f64 {
        self.rho
    }

    /// Standard deviation of a sum of unknowns, by the larger of both covariances.
    fn sigma(&self, terms: &[(usize, f64)]) -> f64 {
        let variance = |covariance: &DMatrix<f64>| {
            let products = terms.iter().flat_map(|a| terms.iter().map(move |b| (a, b)));
            products.map(|(a, b)| a.1 * b.1 * covariance[(a.0, b.0)]).sum::<f64>()
        };
        self.covariances.iter().map(variance).fold(0.0, f64::max).sqrt()
    }

    /// The direction in which the scene moves through the middle of the picture, a unit vector.
    fn along(&self) -> Vector2<f64> {
        let direction = &self.fit.cameras.direction;
        let along = Vector2::new(-direction.x, -direction.y);
        along / along.norm().max(f64::MIN_POSITIVE)
    }

    /// Changes of the place of a typical point along `axis` by the unknowns, in px.
    fn moved(&self, frame: usize, place: [f64; 2], axis: Vector2<f64>) -> Terms {
        let view = self.fit.cameras.view(frame);
        let point = view.point_at(place, self.rho);
        let derivatives = by_unknowns(&view, frame, &point, self.fit.free);
        derivatives.into_iter().map(|(index, by)| (index, axis.dot(&by))).collect()
    }

    /// Standard uncertainties of tau, and of each step of tau: where a point in the middle of the picture is seen, the
    /// first and the last frame at 0 and 1. So a rotation that moves all points like a step counts as one.
    pub(super) fn of_tau(&self, tau: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let last = tau.len() - 1;
        let cameras = &self.fit.cameras;
        let middle = cameras.centre_px;
        let path = (cameras.frames[last].position - cameras.frames[0].position).abs();
        let span_px = path * self.typical_px();
        let terms: Vec<Terms> = (0..=last).map(|frame| self.moved(frame, middle, self.along())).collect();
        let sigma = |parts: &[(usize, f64)]| {
            let of = |&(frame, share): &(usize, f64)| {
                terms[frame].iter().map(move |&(index, by)| (index, share * by)).collect::<Terms>()
            };
            let all: Terms = parts.iter().flat_map(of).collect();
            self.sigma(&all).hypot(INTERPOLATION_BIAS_PX) / span_px
        };
        let inner = |t: usize| sigma(&[(t, 1.0), (0, tau[t] - 1.0), (last, -tau[t])]);
        let of = |t: usize| if t == 0 || t == last { 0.0 } else { inner(t) };
        let step = |t: usize| {
            let part = tau[t + 1] - tau[t];
            sigma(&[(t + 1, 1.0), (t, -1.0), (0, part), (last, -part)])
        };
        ((0..=last).map(of).collect(), (0..last).map(step).collect())
    }

    /// Median of the standard uncertainties of the positions, in units of the path's length.
    pub(super) fn of_positions(&self) -> f64 {
        let free = self.fit.free;
        let of = |frame: usize| self.sigma(&[(free.position(frame), 1.0)]);
        median(&mut (0..self.fit.cameras.frames.len()).map(of).collect::<Vec<_>>()).unwrap_or(0.0)
    }

    /// How far a typical point in the middle of the picture goes for the whole path, in px.
    pub(super) fn typical_px(&self) -> f64 {
        let cameras = &self.fit.cameras;
        let in_picture = cameras.direction.x.hypot(cameras.direction.y);
        self.rho.abs() * cameras.focal_length_px * in_picture
    }

    /// Standard uncertainties, in rad: of the direction in the picture, of that towards the scene, and of the latter with the
    /// focal length known.
    pub(super) fn of_direction(&self) -> [f64; 3] {
        let m = self.fit.cameras.direction;
        let across = self.fit.cameras.across();
        let plane = m.x.hypot(m.y).max(f64::MIN_POSITIVE);
        let roll = across.map(|axis| (m.x * axis.y - m.y * axis.x) / (plane * plane));
        // z grows with the pan; the length of m stays 1.
        let pan = across.map(|axis| axis.z / plane);
        // Where the focal length is longer by a share, the angle is larger by it.
        let of_focal_length = m.z / plane;
        [(roll, 0.0), (pan, 0.0), (pan, -of_focal_length)]
            .map(|(by, longer)| self.sigma(&[(0, by[0]), (1, by[1]), (FOCAL_LENGTH, longer)]))
    }

    /// Standard uncertainty of k1.
    pub(super) fn of_k1(&self) -> f64 {
        self.sigma(&[(K1, 1.0)])
    }

    /// Standard uncertainty of the focal length, as a share of it.
    pub(super) fn of_focal_length(&self) -> f64 {
        self.sigma(&[(FOCAL_LENGTH, 1.0)])
    }

    /// Standard uncertainties that the motion brings to disparities, in px, root mean squares over points: all of it, and what
    /// is left beside an offset, a slope and a scale of the map, which bends it.
    pub(super) fn of_disparities(&self, tau: &[f64]) -> [f64; 2] {
        let along = self.along();
        let views = self.fit.cameras.views();
        let slopes = slopes(tau);
        let some = self.fit.points.len().div_ceil(JUDGED).max(1);
        let points: Vec<&Point> = self.fit.points.iter().step_by(some).collect();
        let mut changes = DMatrix::<f64>::zeros(self.fit.inverse.nrows(), points.len());
        for (column, point) in points.iter().enumerate() {
            for ((frame, view), slope) in views.iter().enumerate().zip(&slopes) {
                for (index, by) in by_unknowns(view, frame, point, self.fit.free) {
                    changes[(index, column)] += slope * along.dot(&by);
                }
            }
        }
        let terms = |row: usize, column: usize| match column {
            0 => 1.0,
            1 | 2 => points[row].bearing[column - 1],
            _ => points[row].rho / self.rho,
        };
        let basis = DMatrix::from_fn(points.len(), 4, terms).qr().q();
        let bent = &changes - &changes * &basis * basis.transpose();
        let count = points.len().max(1) as f64;
        [&changes, &bent].map(|changes| {
            let variance = |covariance: &DMatrix<f64>| changes.dot(&(covariance * changes)) / count;
            self.covariances.iter().map(variance).fold(0.0, f64::max).sqrt()
        })
    }

    /// Standard uncertainty of the row of a point from frame to frame, in px: the root mean square over points and
    /// frames. What all frames have in common moves no row against another.
    pub(super) fn of_rows(&self) -> f64 {
        let along = self.along();
        let across = Vector2::new(-along.y, along.x);
        let views = self.fit.cameras.views();
        let some = |count: usize| (0..count).step_by(count.div_ceil(JUDGED).max(1));
        let frames: Vec<usize> = some(views.len()).collect();
        let count = self.fit.inverse.nrows();
        let (mut sum, mut number) = (0.0, 0.0);
        for point in some(self.fit.points.len()).map(|index| &self.fit.points[index]) {
            let mut changes = DMatrix::<f64>::zeros(count, frames.len());
            for (column, &frame) in frames.iter().enumerate() {
                for (index, by) in by_unknowns(&views[frame], frame, point, self.fit.free) {
                    changes[(index, column)] += across.dot(&by);
                }
            }
            let mean = changes.column_mean();
            changes.column_iter_mut().for_each(|mut change| change -= &mean);
            let variance = |covariance: &DMatrix<f64>| changes.dot(&(covariance * &changes));
            sum += self.covariances.iter().map(variance).fold(0.0, f64::max);
            number += frames.len() as f64;
        }
        f64::sqrt(sum / f64::max(number, 1.0))
    }
}

/// By how much a line is steeper, over the whole path, for each unit that it is off in each frame.
fn slopes(tau: &[f64]) -> Vec<f64> {
    let mean = tau.iter().sum::<f64>() / tau.len() as f64;
    let spread: f64 = tau.iter().map(|tau| (tau - mean).powi(2)).sum();
    tau.iter().map(|tau| (tau - mean) / spread).collect()
}

/// The gradients by the camera unknowns with the points eliminated, summed over the points of each cell, and over those of
/// each frame if frames do not turn.
struct Scores {
    cells: BTreeMap<(i64, i64), DVector<f64>>,
    frames: Vec<DVector<f64>>,
}

fn scores(tracks: &[Track], fit: &Fit) -> Scores {
    let (views, free) = (fit.cameras.views(), fit.free);
    let zero = || DVector::zeros(free.unknowns(views.len()));
    let mut scores = Scores { cells: BTreeMap::new(), frames: vec![zero(); views.len()] };
    let (eliminated, _) = equations(tracks, fit);
    let points = tracks.iter().zip(&fit.points).zip(&fit.weights).zip(&eliminated);
    for (((track, point), weights), Eliminated { inverse, right, mixed }) in points {
        let of_cell = scores.cells.entry(track.cell).or_insert_with(zero);
        mixed.take_off(&(inverse * right), of_cell);
        for (sight, &weight) in track.sights.iter().zip(weights).filter(|(_, weight)| weight.x > 0.0) {
            let Some(seen) = Seen::of(track, (sight, weight), &views[sight.frame], point, free) else {
                continue;
            };
            for (index, by) in seen.unknowns(sight.frame, free) {
                let score = by.dot(&seen.residual);
                of_cell[index] += score;
                scores.frames[sight.frame][index] += score;
            }
            if !free.rotations {
                let moved = inverse * (seen.point.transpose() * seen.residual);
                mixed.take_off(&moved, &mut scores.frames[sight.frame]);
            }
        }
    }
    scores
}

/// Derivatives of the place of a point in a frame by the camera unknowns: index, and both coordinates, in px.
fn by_unknowns(view: &View, frame: usize, point: &Point, free: MotionModel) -> Vec<(usize, Vector2<f64>)> {
    let Some((_, found)) = view.derivatives(point) else { return Vec::new() };
    Seen::unwhitened(found, free).unknowns(frame, free).collect()
}

/// Median of the inverse depths, by what each point tells of the positions.
fn typical_rho(fit: &Fit) -> f64 {
    let of = |(point, weights): (&Point, &Vec<Vector2<f64>>)| {
        (point.rho, point.rho * point.rho * weights.iter().map(|weight| weight.x).sum::<f64>())
    };
    let mut values: Vec<(f64, f64)> = fit.points.iter().zip(&fit.weights).map(of).collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = values.iter().map(|value| value.1).sum();
    let mut before = 0.0;
    let middle = values.iter().find(|value| {
        before += value.1;
        before >= 0.5 * all
    });
    middle.map_or(0.0, |value| value.0)
}
