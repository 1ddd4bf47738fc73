//! Where a board is.

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

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

    /// The pose from the homography from points of the board, counted from their mean, to rays. `None` if the
    /// homography is not that of a board.
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
