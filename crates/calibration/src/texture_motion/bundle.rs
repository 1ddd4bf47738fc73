//! Bundle adjustment: the cameras of all frames and all points together, by robust least squares.
//!
//! Gauss-Newton steps. The three unknowns of each point are eliminated (Schur complement; Brown 1958), so that what
//! is solved has only those of the cameras. Origin and scale of the path are open: two frames are held. Rotations and
//! offsets are small; priors with a mean of zero say how small, and decide what the pictures leave open.

use nalgebra::{DVector, Vector3};

use super::TextureMotionError;
use super::cameras::{Cameras, Point};
use super::fit::{FIRST_SMALL, Fit, LensPrior, Prior, begin, lengths, reweight};
use super::model::{FOCAL_LENGTH, K1, MotionModel};
use super::normal::{Eliminated, Solved, equations, small_unknowns};
use super::track::Track;

/// Least prior standard deviations of a rotation, in rad, and of an offset: a hundred times less than the first ones is not
/// seen in any picture.
const LEAST_SMALL: [f64; 2] = [FIRST_SMALL[0] / 100.0, FIRST_SMALL[1] / 100.0];
/// Priors are estimated so many times, or until they change by less than this share.
const PRIORS: usize = 6;
const SAME_PRIOR: f64 = 0.1;
/// Steps, at most, and the least before they may end: weights settle by then.
const STEPS: usize = 60;
const FEWEST_STEPS: usize = 5;
/// A step is small if no unknown changes by this share of its standard deviation.
const SMALL: f64 = 0.05;
/// Fewest points in a frame that agree.
const FEWEST: usize = 4;

/// Adjusts the cameras to all tracks, from `start` on. How large rotations and offsets usually are is estimated from
/// themselves (expectation and maximisation; Dempster, Laird and Rubin 1977).
pub(super) fn adjust(
    tracks: &[Track],
    start: &Cameras,
    lens: LensPrior,
    free: MotionModel,
) -> Result<Fit, TextureMotionError> {
    let mut fit = begin(tracks, start, free, Prior { lens, small: FIRST_SMALL });
    minimise(tracks, &mut fit)?;
    if !(free.rotations || free.offsets) {
        return Ok(fit);
    }
    for _ in 0..PRIORS {
        let before = fit.prior.small;
        fit.prior.small = usual_sizes(&fit);
        let changes = |index: usize| (fit.prior.small[index] / before[index]).ln().abs() > SAME_PRIOR;
        if !(changes(0) || changes(1)) {
            break;
        }
        minimise(tracks, &mut fit)?;
    }
    Ok(fit)
}

/// The same fit with a focal length that may be any within its prior, for what that does to uncertainties.
pub(super) fn with_free_focal_length(tracks: &[Track], mut fit: Fit) -> Result<Fit, TextureMotionError> {
    fit.free.focal_length = true;
    fit.inverse = Solved::of(equations(tracks, &fit).1, &fit)?.inverse();
    Ok(fit)
}

/// Adjusts the cameras of another fit to these tracks.
pub(super) fn adjust_again(tracks: &[Track], other: &Fit) -> Result<Cameras, TextureMotionError> {
    let mut fit = begin(tracks, &other.cameras, other.free, other.prior);
    minimise(tracks, &mut fit)?;
    Ok(fit.cameras)
}

fn minimise(tracks: &[Track], fit: &mut Fit) -> Result<(), TextureMotionError> {
    for step in 0.. {
        reweight(tracks, fit);
        check_connected(tracks, fit)?;
        let (eliminated, normal) = equations(tracks, fit);
        let solved = Solved::of(normal, fit)?;
        let (change, largest) = solved.step();
        if step == STEPS || (step >= FEWEST_STEPS && largest < SMALL) {
            fit.inverse = solved.inverse();
            break;
        }
        move_cameras(&mut fit.cameras, fit.free, &change);
        move_points(&mut fit.points, &eliminated, Some(&change));
    }
    Ok(())
}

/// Root mean squares of all rotations and of all offsets, their uncertainty included.
fn usual_sizes(fit: &Fit) -> [f64; 2] {
    let mut sums = [(0.0, 0.0); 2];
    for (index, value, kind, _) in small_unknowns(fit) {
        let (sum, count) = sums[kind];
        sums[kind] = (sum + value * value + fit.inverse[(index, index)], count + 1.0);
    }
    [0, 1].map(|kind| match sums[kind] {
        (_, 0.0) => fit.prior.small[kind],
        (sum, count) => f64::sqrt(sum / count).max(LEAST_SMALL[kind]),
    })
}

/// Adjusts points alone to known cameras, and gives the lengths of all residuals in units of what each sight states.
pub(super) fn residuals_of_unseen(tracks: &[Track], cameras: &Cameras, prior: Prior) -> Vec<Vec<f64>> {
    const ROUNDS: usize = 10;
    let mut fit = begin(tracks, cameras, MotionModel::default(), prior);
    for _ in 0..ROUNDS {
        reweight(tracks, &mut fit);
        let (eliminated, _) = equations(tracks, &fit);
        move_points(&mut fit.points, &eliminated, None);
    }
    lengths(tracks, &fit)
}

fn check_connected(tracks: &[Track], fit: &Fit) -> Result<(), TextureMotionError> {
    let mut points = vec![0; fit.cameras.frames.len()];
    for (track, weights) in tracks.iter().zip(&fit.weights) {
        let agreeing = track.sights.iter().zip(weights).filter(|(_, weight)| weight.x > 0.0);
        agreeing.for_each(|(sight, _)| points[sight.frame] += 1);
    }
    let apart: Vec<usize> = (0..points.len()).filter(|&frame| points[frame] < FEWEST).collect();
    if apart.is_empty() { Ok(()) } else { Err(TextureMotionError::Apart { frames: apart }) }
}

fn move_cameras(cameras: &mut Cameras, free: MotionModel, change: &DVector<f64>) {
    let [first, second] = cameras.across();
    cameras.direction = (cameras.direction + first * change[0] + second * change[1]).normalize();
    cameras.k1 += change[K1];
    cameras.lengthen(change[FOCAL_LENGTH].exp());
    for (frame, pose) in cameras.frames.iter_mut().enumerate() {
        let at = free.position(frame);
        pose.position += change[at];
        if free.rotations {
            pose.rotation_rad += Vector3::new(change[at + 1], change[at + 2], change[at + 3]);
        }
        if free.offsets {
            let at = free.offset(frame);
            pose.offset[0] += change[at];
            pose.offset[1] += change[at + 1];
        }
    }
}

fn move_points(points: &mut [Point], eliminated: &[Eliminated], change: Option<&DVector<f64>>) {
    for (point, Eliminated { inverse, right, mixed }) in points.iter_mut().zip(eliminated) {
        let taken = change.map_or_else(Vector3::zeros, |change| mixed.sum(change));
        let step = inverse * (right - taken);
        *point = point.seen_by_longer(change.map_or(1.0, |change| change[FOCAL_LENGTH].exp()));
        point.bearing[0] += step.x;
        point.bearing[1] += step.y;
        point.rho += step.z;
    }
}
