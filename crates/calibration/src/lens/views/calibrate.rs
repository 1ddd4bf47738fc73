//! Calibration of a lens from views of a board.

use super::calibration::{LensCalibration, PointName, PointResidual, ViewFit};
use super::error::LensError;
use super::findings::{coverage, largest_angle, warnings};
use super::homography::MEDIAN_NORM;
use super::point::{PlanarPoint, ROUNDING_PX, View, residual, squared_distance};
use super::pose::BoardPose;
use super::problem::ViewsProblem;
use super::start::start;
use super::terms::Terms;
use crate::lens::estimate::LensEstimate;
use crate::lens::model::Lens;
use epirig_core::least_squares::{Loss, Minimum, minimise};
use epirig_core::statistics::upper_median;

/// Three views are the fewest from which Zhang's constraints give a general lens.
const VIEWS: usize = 3;
/// Points that a view needs: twice the four of a homography, so that a wrong one stands out.
const POINTS: usize = 8;
/// Up to this norm of a residual, in robust standard deviations, a point counts by its square; 86 % of
/// Gaussian ones do.
const HUBER: f64 = 2.0;
/// Points beyond this norm, in robust standard deviations, are wrong: of Gaussian ones 4 in 100 000 are.
const REJECTED: f64 = 4.5;
/// The spread of residuals is known well enough when it changes by less than this share.
const SETTLED: f64 = 0.01;
/// Rounds of weighing, and of rejecting; each ends long before, unless it goes to and fro.
const ROUNDS: usize = 20;
/// A focal length that is known worse than this share is not calibrated: the engraving on a lens is as good.
const FOCAL_LENGTH_SHARE: f64 = 0.05;

/// Which points of each view count.
pub(super) type Used = Vec<Vec<bool>>;

/// A lens and the poses of all boards.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    pub(super) lens: Lens,
    pub(super) poses: Vec<BoardPose>,
}

/// The lens that fits best to all views of frames of `rows` x `columns`.
///
/// Wrong points are found by Huber's loss, left out and named; the rest is plain least squares. The
/// covariance is scaled by the residuals, so only the ratios of the stated standard deviations matter.
///
/// # Errors
/// [`LensError`] if there are too few views or points, if they leave the focal length open, or if a view
/// contradicts the others.
pub fn calibrate(
    views: &[View],
    rows: usize,
    columns: usize,
    terms: Terms,
) -> Result<LensCalibration, LensError> {
    check(views, VIEWS)?;
    let (lens, poses) = start(views, rows, columns)?;
    let begin = Solution { lens, poses };
    // Points that no camera can see are in no view of a board.
    enough(&within(views, &begin, f64::INFINITY), 0.0)?;
    let mut used: Used = views.iter().map(|view| vec![true; view.len()]).collect();
    let (mut solution, mut sigma) = robust(views, &used, terms, begin)?;
    for _ in 0..ROUNDS {
        let now = within(views, &solution, REJECTED * sigma);
        let settled = now == used;
        used = now;
        enough(&used, 0.5)?;
        (solution, _) = solve(views, &used, terms, solution, Loss::Squares)?;
        sigma = spread(views, &solution, terms);
        if settled {
            break;
        }
    }
    summary(views, &used, (rows, columns), terms, solution)
}

/// Refuses views from which no lens can be calibrated.
pub(super) fn check(views: &[View], needed: usize) -> Result<(), LensError> {
    if views.len() < needed {
        return Err(LensError::TooFewViews { views: views.len(), needed });
    }
    for (view, points) in views.iter().enumerate() {
        if points.len() < POINTS {
            return Err(LensError::TooFewPoints { view, points: points.len(), needed: POINTS });
        }
        let wrong = points.iter().position(|point| {
            let numbers = [point.x_mm, point.y_mm, point.x_px, point.y_px, point.sigma_px];
            numbers.iter().any(|number| !number.is_finite()) || point.sigma_px <= 0.0
        });
        if let Some(point) = wrong {
            return Err(LensError::NotAPoint { view, point });
        }
    }
    Ok(())
}

/// Lens and poses that fit best to the points that are used.
pub(super) fn solve(
    views: &[View],
    used: &Used,
    terms: Terms,
    from: Solution,
    loss: Loss,
) -> Result<(Solution, Minimum), LensError> {
    let points = views.iter().zip(used).map(|(view, used)| {
        view.iter().zip(used).filter(|(_, used)| **used).map(|(point, _)| *point).collect()
    });
    let lens = terms.keep(&from.lens);
    let problem = ViewsProblem::new(lens, terms.estimated(), points.collect());
    let found = minimise(&problem, problem.parameters_of(&lens, &from.poses), loss)?;
    Ok((Solution { lens: problem.lens(&found.parameters), poses: problem.poses(&found.parameters) }, found))
}

/// Lens and poses by Huber's loss, with the spread of the residuals; both are found in turns.
fn robust(views: &[View], used: &Used, terms: Terms, from: Solution) -> Result<(Solution, f64), LensError> {
    let (mut solution, mut sigma) = (from.clone(), spread(views, &from, terms));
    for _ in 0..ROUNDS {
        (solution, _) = solve(views, used, terms, solution, Loss::Huber(HUBER * sigma))?;
        let now = spread(views, &solution, terms);
        let settled = (now - sigma).abs() <= SETTLED * sigma;
        sigma = now;
        if settled {
            break;
        }
    }
    Ok((solution, sigma))
}

/// Standard deviation of the residuals, in units of their stated ones: by the median, so that wrong points do
/// not matter; and with regard to the degrees of freedom that the fit has taken.
fn spread(views: &[View], solution: &Solution, terms: Terms) -> f64 {
    let mut norms: Vec<f64> = norms(views, solution).into_iter().flatten().collect();
    let residuals = 2.0 * norms.len() as f64;
    let free = residuals - (terms.estimated().len() + 6 * views.len()) as f64;
    let rounding =
        ROUNDING_PX / views.iter().flatten().map(|point| point.sigma_px).fold(f64::INFINITY, f64::min);
    (upper_median(&mut norms).unwrap_or(f64::NAN) / MEDIAN_NORM * (residuals / free.max(1.0)).sqrt())
        .max(rounding)
}

/// Norms of the residuals over their stated standard deviations.
fn norms(views: &[View], solution: &Solution) -> Vec<Vec<f64>> {
    let norm =
        |pose, point: &PlanarPoint| squared_distance(&solution.lens, pose, point).sqrt() / point.sigma_px;
    views
        .iter()
        .zip(&solution.poses)
        .map(|(view, pose)| view.iter().map(|point| norm(pose, point)).collect())
        .collect()
}

/// Which points are so near to their predictions; none behind the camera is.
fn within(views: &[View], solution: &Solution, limit: f64) -> Used {
    norms(views, solution)
        .into_iter()
        .map(|view| view.into_iter().map(|norm| norm <= limit).collect())
        .collect()
}

/// Refuses a view of which more than this share does not count.
fn enough(used: &Used, share: f64) -> Result<(), LensError> {
    for (view, used) in used.iter().enumerate() {
        let (rejected, points) = (used.iter().filter(|used| !**used).count(), used.len());
        if rejected as f64 > share * points as f64 {
            return Err(LensError::ViewWrong { view, rejected, points });
        }
    }
    Ok(())
}

fn summary(
    views: &[View],
    used: &Used,
    (rows, columns): (usize, usize),
    terms: Terms,
    solution: Solution,
) -> Result<LensCalibration, LensError> {
    let (Solution { lens, poses }, minimum) = solve(views, used, terms, solution, Loss::Squares)?;
    let variance_factor = minimum.variance_factor();
    let mut covariance = [[0.0; Lens::PARAMETERS]; Lens::PARAMETERS];
    for row in terms.estimated() {
        for column in terms.estimated() {
            covariance[row][column] = variance_factor * minimum.covariance[(row, column)];
        }
    }
    let estimate = LensEstimate { rows, columns, lens, covariance };
    let [sigma_x, sigma_y, ..] = estimate.sigma();
    let sigma_share = (sigma_x / lens.focal_length_x_px).max(sigma_y / lens.focal_length_y_px);
    let spread_rad = largest_angle(&poses);
    if sigma_share.is_nan() || sigma_share > FOCAL_LENGTH_SHARE {
        return Err(LensError::PosesAlike { sigma_share: Some(sigma_share), spread_rad: Some(spread_rad) });
    }
    let residuals: Vec<Vec<PointResidual>> = views
        .iter()
        .zip(used)
        .zip(&poses)
        .map(|((view, used), pose)| {
            let of = |(point, used): (&PlanarPoint, &bool)| {
                let (dx_px, dy_px) = residual(&lens, pose, point);
                PointResidual { x_px: point.x_px, y_px: point.y_px, dx_px, dy_px, rejected: !used }
            };
            view.iter().zip(used).map(of).collect()
        })
        .collect();
    let fits: Vec<ViewFit> = residuals.iter().map(|view| fit(view)).collect();
    let rejected = residuals
        .iter()
        .enumerate()
        .flat_map(|(view, points)| {
            let wrong = points.iter().enumerate().filter(|(_, residual)| residual.rejected);
            wrong.map(move |(point, _)| PointName { view, point })
        })
        .collect();
    let coverage = coverage(&residuals, rows, columns);
    Ok(LensCalibration {
        estimate,
        terms,
        rms_px: rms(residuals.iter().flatten()),
        variance_factor,
        warnings: warnings(sigma_share, spread_rad, &fits, &coverage),
        residuals,
        poses,
        views: fits,
        coverage,
        rejected,
        cross_validation: Vec::new(),
    })
}

fn fit(view: &[PointResidual]) -> ViewFit {
    let rejected = view.iter().filter(|residual| residual.rejected).count();
    ViewFit { rms_px: rms(view.iter()), points: view.len(), rejected }
}

/// Without the rejected.
fn rms<'a>(residuals: impl Iterator<Item = &'a PointResidual>) -> f64 {
    let (sum, count) =
        residuals.filter(|residual| !residual.rejected).fold((0.0, 0_usize), |(sum, count), residual| {
            (sum + residual.dx_px.powi(2) + residual.dy_px.powi(2), count + 1)
        });
    (sum / count as f64).sqrt()
}
