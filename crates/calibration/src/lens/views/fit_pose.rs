//! The pose of a board that a known lens sees.

use super::error::LensError;
use super::homography::{Pair, homography};
use super::point::PlanarPoint;
use super::pose::BoardPose;
use super::problem::ViewsProblem;
use crate::lens::model::Lens;
use epirig_core::least_squares::{LeastSquaresError, Loss, minimise};

/// The pose of a board as a known lens sees it: least squares over the six numbers of the pose.
///
/// # Errors
/// [`LensError::OnALine`] (of view 0) if the points do not determine it, or are not where the lens can see
/// anything; [`LensError::Search`] if the search fails.
pub fn fit_pose(lens: &Lens, points: &[PlanarPoint]) -> Result<BoardPose, LensError> {
    let middle = middle(points);
    let rays: Option<Vec<Pair>> = points
        .iter()
        .map(|point| {
            let (a, b) = lens.ray(point.x_px, point.y_px)?;
            Some(Pair { from: [point.x_mm - middle[0], point.y_mm - middle[1]], to: [a, b] })
        })
        .collect();
    let start = rays
        .and_then(|rays| homography(&rays))
        .and_then(|homography| BoardPose::from_homography(&homography))
        .ok_or(LensError::OnALine { view: 0 })?
        .with_origin_moved_by(middle);
    refine_pose(lens, points.iter().copied(), start).map_err(|error| match error {
        LeastSquaresError::Undetermined { .. } => LensError::OnALine { view: 0 },
        other => LensError::Search(other),
    })
}

/// Mean of the points on the board, in mm. Homographies are taken about it: the board's own origin may lie
/// far off, even behind the camera.
pub(super) fn middle(points: &[PlanarPoint]) -> [f64; 2] {
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.x_mm, y + point.y_mm));
    [x / count, y / count]
}

/// The pose nearby that fits best.
pub(super) fn refine_pose(
    lens: &Lens,
    points: impl Iterator<Item = PlanarPoint>,
    start: BoardPose,
) -> Result<BoardPose, LeastSquaresError> {
    let problem = ViewsProblem::new(*lens, 0..0, vec![points.collect()]);
    let found = minimise(&problem, problem.parameters_of(lens, &[start]), Loss::Squares)?;
    Ok(problem.poses(&found.parameters)[0])
}
