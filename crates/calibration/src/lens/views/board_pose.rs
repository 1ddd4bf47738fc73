//! Where a board is.

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use super::homography::{Pair, homography};
use super::problem::ViewsProblem;
use super::{Lens, LensError, PlanarPoint};
use epirig_core::least_squares::{LeastSquaresError, Loss, minimise};

/// Place of a board in the frame of the camera: a point p of the board (z = 0) lies at R p + t.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardPose {
    /// R as axis times angle, in rad; as OpenCV's `rvec`.
    pub rotation_rad: [f64; 3],
    /// t, in mm; as OpenCV's `tvec`.
    pub translation_mm: [f64; 3],
}

impl BoardPose {
    /// R.
    pub fn rotation(&self) -> Matrix3<f64> {
        Rotation3::new(Vector3::from(self.rotation_rad)).into_inner()
    }

    /// The point (x, y) of the board in the frame of the camera, in mm.
    pub fn point_mm(&self, x_mm: f64, y_mm: f64) -> [f64; 3] {
        (self.rotation() * Vector3::new(x_mm, y_mm, 0.0) + Vector3::from(self.translation_mm)).into()
    }

    /// The board's z axis in the frame of the camera; length 1.
    pub fn normal(&self) -> [f64; 3] {
        self.rotation().column(2).into_owned().into()
    }

    /// By the homography from points of the board, which lie about the origin, to rays. `None` if it is none of a board.
    pub(super) fn from_homography(rays: &Matrix3<f64>) -> Option<Self> {
        let scale = 0.5 * (rays.column(0).norm() + rays.column(1).norm());
        // Of the two signs the one that has the board before the camera.
        let columns = rays / scale.copysign(rays[(2, 2)]);
        let (x, y) = (columns.column(0).into_owned(), columns.column(1).into_owned());
        // The nearest rotation; it is one, because the third column is the product of the first two.
        let svd = Matrix3::from_columns(&[x, y, x.cross(&y)]).svd(true, true);
        let rotation = Rotation3::from_matrix_unchecked(svd.u? * svd.v_t?);
        let translation = columns.column(2).into_owned();
        let pose = Self { rotation_rad: rotation.scaled_axis().into(), translation_mm: translation.into() };
        pose.is_finite().then_some(pose)
    }

    /// The pose of the same board, whose points are now counted from (-x, -y).
    pub(super) fn with_origin_moved_by(&self, [x, y]: [f64; 2]) -> Self {
        let moved = Vector3::from(self.translation_mm) - self.rotation() * Vector3::new(x, y, 0.0);
        Self { translation_mm: moved.into(), ..*self }
    }

    fn is_finite(&self) -> bool {
        self.rotation_rad.iter().chain(&self.translation_mm).all(|value| value.is_finite())
    }
}

/// Where the board is that a known lens sees so: least squares over the six numbers of the pose.
///
/// # Errors
/// [`LensError::OnALine`] (of view 0) if the points do not determine it, or are not where the lens can see anything;
/// [`LensError::Search`] if the search fails.
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

/// Mean of the points on the board, in mm. Homographies are taken about it: the board's own origin may lie far off, even behind the camera.
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
