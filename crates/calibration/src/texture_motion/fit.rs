//! Cameras and points as they are adjusted, and how well sights agree with them.

use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};
use rayon::prelude::*;

use super::cameras::{Cameras, Point};
use super::model::MotionModel;
use super::seen::whitening;
use super::track::{Sight, Track};
use epirig_core::statistics::median;

/// From the median of absolute values to the standard deviation of normal numbers.
const MAD: f64 = 1.482_602_218_505_602;
/// Tukey's biweight leaves out what is so many robust standard deviations off; 95 % as good as least squares for two normal
/// numbers.
const TUKEY: f64 = 5.12;
/// First prior standard deviations of a rotation, in rad (0.05 degrees), and of an offset, as a share of the path.
pub(super) const FIRST_SMALL: [f64; 2] = [0.05 * std::f64::consts::PI / 180.0, 0.005];

/// A lens as it is known before.
#[derive(Debug, Clone, Copy)]
pub(super) struct LensPrior {
    /// Focal length, in px.
    pub(super) focal_length_px: f64,
    /// Its standard deviation as a share of it.
    pub(super) focal_length_sigma: f64,
    /// Standard deviation of k1; its mean is 0.
    pub(super) k1_sigma: f64,
}

/// What is known of unknowns before.
#[derive(Clone, Copy)]
pub(super) struct Prior {
    pub(super) lens: LensPrior,
    /// Standard deviations of a rotation, in rad, and of an offset, as a share of the path; their means are 0.
    pub(super) small: [f64; 2],
}

/// The result of an adjustment.
#[derive(Clone)]
pub(super) struct Fit {
    pub(super) cameras: Cameras,
    pub(super) free: MotionModel,
    /// A point for each track.
    pub(super) points: Vec<Point>,
    /// Weights of each sight of each track along and across the motion: 0 for outliers, else up to 1 over the variance
    /// that its frame has in units of what sights state.
    pub(super) weights: Vec<Vec<Vector2<f64>>>,
    pub(super) prior: Prior,
    /// The inverse of the reduced normal equations, by unknown; zero for those that are held.
    pub(super) inverse: DMatrix<f64>,
}

/// How well tracks and cameras agree.
pub(super) struct Agreement {
    /// Number of tracks that are not left out.
    pub(super) points: usize,
    /// Share of the sights that are left out.
    pub(super) rejected: f64,
    /// Root mean square of the residuals of the others, on either axis, in px.
    pub(super) residual_px: f64,
}

impl Fit {
    pub(super) fn agreement(&self, tracks: &[Track]) -> Agreement {
        let views = self.cameras.views();
        let (mut points, mut sights, mut agreeing, mut squares) = (0, 0, 0, 0.0);
        for ((track, point), weights) in tracks.iter().zip(&self.points).zip(&self.weights) {
            points += usize::from(weights.iter().any(|weight| weight.x > 0.0));
            sights += weights.len();
            for (sight, _) in track.sights.iter().zip(weights).filter(|(_, weight)| weight.x > 0.0) {
                let Some([x, y]) = views[sight.frame].place(point) else { continue };
                agreeing += 1;
                squares += (sight.place[0] - x).powi(2) + (sight.place[1] - y).powi(2);
            }
        }
        let of = |agreeing: usize| agreeing.max(1) as f64;
        Agreement {
            points,
            rejected: 1.0 - agreeing as f64 / of(sights),
            residual_px: (squares / (2.0 * of(agreeing))).sqrt(),
        }
    }
}

/// Points where the sights in the middle of each track put them at their best inverse depth.
pub(super) fn begin(tracks: &[Track], cameras: &Cameras, free: MotionModel, prior: Prior) -> Fit {
    let views = cameras.views();
    let point = |track: &Track| {
        // Linear in u, v and rho: (x - rho delta) is parallel to the ray of each sight.
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for sight in &track.sights {
            let [ray, moved] = views[sight.frame].line(sight.place);
            let rows = [
                (Vector3::new(1.0, 0.0, ray.x * moved.z - moved.x), ray.x),
                (Vector3::new(0.0, 1.0, ray.y * moved.z - moved.y), ray.y),
            ];
            for (row, value) in rows {
                matrix += row * row.transpose();
                right += row * value;
            }
        }
        matrix += Matrix3::identity() * (1e-9 * matrix.trace());
        let found = matrix.try_inverse().unwrap_or_else(Matrix3::zeros) * right;
        Point { bearing: [found.x, found.y], rho: found.z }
    };
    let unknowns = free.unknowns(cameras.frames.len());
    Fit {
        points: tracks.par_iter().map(point).collect(),
        weights: tracks.iter().map(|track| vec![Vector2::repeat(1.0); track.sights.len()]).collect(),
        cameras: cameras.clone(),
        free,
        prior,
        inverse: DMatrix::zeros(unknowns, unknowns),
    }
}

/// Residuals of all sights along and across the motion, in units of what each states; infinite behind the camera.
fn normalised(tracks: &[Track], fit: &Fit) -> Vec<Vec<Vector2<f64>>> {
    let views = fit.cameras.views();
    let of = |(track, point): (&Track, &Point)| {
        let residual = |sight: &Sight| {
            let Some([x, y]) = views[sight.frame].place(point) else {
                return Vector2::repeat(f64::INFINITY);
            };
            let off = Vector2::new(sight.place[0] - x, sight.place[1] - y);
            Vector2::from(whitening(track, sight).map(|(axis, share)| axis.dot(&off) * share))
        };
        track.sights.iter().map(residual).collect()
    };
    tracks.par_iter().zip(&fit.points).map(of).collect()
}

/// Lengths of the residuals of all sights, in units of what each states.
pub(super) fn lengths(tracks: &[Track], fit: &Fit) -> Vec<Vec<f64>> {
    let of_track = |residuals: Vec<Vector2<f64>>| residuals.iter().map(Vector2::norm).collect();
    normalised(tracks, fit).into_iter().map(of_track).collect()
}

/// Redescending weights: outliers lose theirs. Along the motion one scale holds for all frames, as each has its own
/// position. Across it each frame has its own: where all points of a frame are off, it is the frame that departs, and not
/// the points.
pub(super) fn reweight(tracks: &[Track], fit: &mut Fit) {
    let residuals = normalised(tracks, fit);
    let along = scale(&mut residuals.iter().flatten().map(|residual| residual.x.abs()).collect::<Vec<_>>());
    let across = scales_across(tracks, &residuals, fit.cameras.frames.len());
    let weight = |(sight, residual): (&Sight, &Vector2<f64>)| {
        let scale = Vector2::new(along, across[sight.frame]);
        let share = residual.component_div(&scale).norm();
        if share >= TUKEY {
            return Vector2::zeros();
        }
        let weight = (1.0 - (share / TUKEY).powi(2)).powi(2);
        scale.map(|scale| weight / (scale * scale))
    };
    let of = |(track, residuals): (&Track, &Vec<Vector2<f64>>)| {
        track.sights.iter().zip(residuals).map(weight).collect()
    };
    fit.weights = tracks.iter().zip(&residuals).map(of).collect();
}

/// Robust standard deviation of residuals of these sizes, in units of what sights state. They are never known better: few
/// points may agree by chance.
fn scale(sizes: &mut [f64]) -> f64 {
    (MAD * median(sizes).unwrap_or(0.0)).max(1.0)
}

fn scales_across(tracks: &[Track], residuals: &[Vec<Vector2<f64>>], frames: usize) -> Vec<f64> {
    let mut own = vec![Vec::new(); frames];
    for (track, residuals) in tracks.iter().zip(residuals) {
        let both = track.sights.iter().zip(residuals);
        both.for_each(|(sight, residual)| own[sight.frame].push(residual.y.abs()));
    }
    own.iter_mut().map(|sizes| scale(sizes)).collect()
}
