//! Stage axis and positions from the tracks of a target.

use super::bundle::{Bundle, OF_POINT};
use super::{AxisPoint, Direction, MeasuredTau, StageAxis, StageAxisError, TrackResidual, vanishing};
use crate::lens::LensEstimate;
use crate::target::{Observation, Tracks};
use epirig_core::least_squares::{Loss, Minimum, minimise};
use epirig_core::statistics::upper_median;

/// Frames that must show a corner if it is to count: two fix its place and depth, the third can contradict.
const FRAMES_OF_A_CORNER: usize = 3;
/// Corners needed: with one on each of two rows and a free position in each frame, nothing could contradict.
const CORNERS: usize = 4;
/// Limit of the robust loss, in standard deviations of a coordinate.
const HUBER: f64 = 2.0;
/// Distance at which an observation is wrong, in the same: of good ones, one in 25,000 lies farther off
/// (exp(-4.5^2 / 2)).
const REJECTED: f64 = 4.5;
/// Least noise, as a share of the corners' stated sigma: drawn corners may be exact, and rounding would then
/// make the prior of the lens worth nothing.
const EXACT: f64 = 1e-3;
/// Median of the length of a vector of two independent normal numbers: sqrt(2 ln 2).
const MEDIAN_LENGTH: f64 = 1.177_410_022_515_474_7;

/// The direction of the stage axis and the position of every frame, from the target's tracks.
///
/// `positions_mm` are the stage's own, one for each frame, or the frames' indices if unknown. They fix scale
/// and origin of tau, and hold frames that no corner connects. `lens` is the prior of the lens; parameters
/// with variance 0 are fixed.
///
/// # Errors
/// [`StageAxisError`] if the tracks do not tell the direction.
///
/// # Panics
/// If there are less than two positions, or an observation is of a frame beyond them.
pub fn find(tracks: &Tracks, positions_mm: &[f64], lens: &LensEstimate) -> Result<StageAxis, StageAxisError> {
    let (corners, observations) = long_tracks(tracks)?;
    let (first, last) = (positions_mm[0], positions_mm[positions_mm.len() - 1]);
    let tau: Vec<f64> = positions_mm.iter().map(|position| (position - first) / (last - first)).collect();
    let (direction, points) = start(&observations, corners.len(), &tau, lens)?;
    // Half a mean step is far more than the error of a working stage; beside the corners it has next to no
    // weight.
    let tau_sigma = 0.5 / (tau.len() - 1) as f64;

    let mut used = vec![true; observations.len()];
    let bundle = Bundle::new(&observations, &used, lens, corners.len(), (&tau, tau_sigma))
        .ok_or(StageAxisError::BadLens)?;
    let robust = minimise(&bundle, bundle.start(direction, &points), Loss::Huber(HUBER))?;
    let lengths: Vec<f64> = observations
        .iter()
        .map(|seen| length(bundle.residual(&robust.parameters, seen)) / seen.sigma_px)
        .collect();
    let noise = (upper_median(&mut lengths.clone()).unwrap_or(0.0) / MEDIAN_LENGTH).max(EXACT);
    used.iter_mut().zip(&lengths).for_each(|(used, length)| *used = *length <= REJECTED * noise);

    // Priors have absolute standard deviations, so those of the observations must be absolute, too: their
    // factor is found first, then used.
    let mut bundle = Bundle::new(&observations, &used, lens, corners.len(), (&tau, tau_sigma))
        .ok_or(StageAxisError::BadLens)?;
    bundle.noise = noise;
    let once = minimise(&bundle, robust.parameters, Loss::Squares)?;
    bundle.noise = (noise * spread(&bundle, &once)).max(EXACT);
    let found = minimise(&bundle, once.parameters, Loss::Squares)?;
    Ok(describe(&bundle, &found, &corners))
}

/// Corners seen often enough, by their index in the tracks, and their observations, whose corners are counted
/// anew.
fn long_tracks(tracks: &Tracks) -> Result<(Vec<usize>, Vec<Observation>), StageAxisError> {
    let mut seen = vec![0; tracks.corners.len()];
    tracks.observations.iter().for_each(|observation| seen[observation.corner] += 1);
    let corners: Vec<usize> = (0..seen.len()).filter(|&corner| seen[corner] >= FRAMES_OF_A_CORNER).collect();
    if corners.len() < CORNERS {
        return Err(StageAxisError::TooFewTracks {
            corners: corners.len(),
            frames: FRAMES_OF_A_CORNER,
            needed: CORNERS,
        });
    }
    let observations = tracks
        .observations
        .iter()
        .filter_map(|seen| {
            corners.binary_search(&seen.corner).ok().map(|corner| Observation { corner, ..*seen })
        })
        .collect();
    Ok((corners, observations))
}

/// Direction in closed form, and a straight line through each corner's rectified track.
fn start(
    observations: &[Observation],
    corners: usize,
    tau: &[f64],
    lens: &LensEstimate,
) -> Result<(Direction, Vec<[f64; OF_POINT]>), StageAxisError> {
    let mut rays: Vec<Vec<[f64; 2]>> = vec![Vec::new(); corners];
    let mut at: Vec<Vec<f64>> = vec![Vec::new(); corners];
    for seen in observations {
        let ray = lens.lens.ray(seen.x_px, seen.y_px);
        let (a, b) = ray.ok_or(StageAxisError::BeyondLens { x_px: seen.x_px, y_px: seen.y_px })?;
        rays[seen.corner].push([a, b]);
        at[seen.corner].push(tau[seen.frame]);
    }
    let v = vanishing::direction(rays.iter().map(Vec::as_slice)).ok_or(StageAxisError::OneLine)?;
    let direction = Direction::of(v).ok_or(StageAxisError::NotAlongRows)?;
    let points = rays
        .iter()
        .zip(&at)
        .map(|(track, at)| {
            let count = track.len() as f64;
            let rectified = || {
                track.iter().map(|[a, b]| direction.rectified([*a, *b, 1.0])).map(|[x, y, z]| (x / z, y / z))
            };
            let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / count;
            let (x, y) = (mean(&mut rectified().map(|(x, _)| x)), mean(&mut rectified().map(|(_, y)| y)));
            let middle = mean(&mut at.iter().copied());
            let spread: f64 = at.iter().map(|tau| (tau - middle).powi(2)).sum();
            let slope =
                rectified().zip(at).map(|((at_x, _), tau)| (at_x - x) * (tau - middle)).sum::<f64>() / spread;
            [x - slope * middle, y, slope]
        })
        .collect();
    Ok((direction, points))
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// Standard deviation of the observations over the assumed one: squares over degrees of freedom, without
/// those of the priors.
fn spread(bundle: &Bundle<'_>, found: &Minimum) -> f64 {
    let seen = bundle.observations.iter().zip(bundle.used).filter(|(_, used)| **used);
    let (squares, count) = seen.fold((0.0, 0), |(squares, count), (seen, _)| {
        let off = length(bundle.residual(&found.parameters, seen)) / (bundle.noise * seen.sigma_px);
        (squares + off * off, count + 2)
    });
    // Lens and tau are bound by their priors; the other parameters cost degrees of freedom.
    let freedom = count as f64 - (found.parameters.len() - bundle.angle_column()) as f64;
    (squares / freedom.max(1.0)).sqrt()
}

fn describe(bundle: &Bundle<'_>, found: &Minimum, corners: &[usize]) -> StageAxis {
    let at = &found.parameters;
    let sigma = |column: usize| found.covariance[(column, column)].sqrt();
    let direction = bundle.direction_at(at);
    let lens = bundle.lens_estimate(at, &found.covariance);
    let focal_length_px = lens.lens.focal_length_x_px;
    let mut residuals = Vec::new();
    let mut rejected = Vec::new();
    let mut seen_frames = vec![false; bundle.tau_column.len()];
    for (seen, used) in bundle.observations.iter().zip(bundle.used) {
        let corner = corners[seen.corner];
        let Some((a, b)) = lens.lens.ray(seen.x_px, seen.y_px).filter(|_| *used) else {
            rejected.push((seen.frame, corner));
            continue;
        };
        seen_frames[seen.frame] = true;
        let [x, y, z] = direction.rectified([a, b, 1.0]);
        let [point_x, point_y, disparity] = bundle.point_at(at, seen.corner);
        let predicted = point_x + disparity * bundle.tau_at(at, seen.frame);
        residuals.push(TrackResidual {
            frame: seen.frame,
            corner,
            column_px: focal_length_px * x / z,
            along_px: focal_length_px * (x / z - predicted),
            across_px: lens.lens.focal_length_y_px * (y / z - point_y),
        });
    }
    let tau = (0..seen_frames.len())
        .map(|frame| {
            let sigma = bundle.tau_column[frame].map_or(0.0, sigma);
            seen_frames[frame].then(|| MeasuredTau { tau: bundle.tau_at(at, frame), sigma })
        })
        .collect();
    let points = corners
        .iter()
        .enumerate()
        .map(|(point, &corner)| {
            let [x, y, disparity] = bundle.point_at(at, point);
            AxisPoint { corner, x, y, disparity }
        })
        .collect();
    let angles = bundle.angle_column();
    StageAxis {
        direction,
        roll_sigma_rad: sigma(angles),
        pan_sigma_rad: sigma(angles + 1),
        lens,
        tau,
        points,
        residuals,
        rejected,
        noise_factor: bundle.noise,
    }
}
