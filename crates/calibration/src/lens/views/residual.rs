//! The distance between a point seen and the point predicted.

use super::point::PlanarPoint;
use super::pose::BoardPose;
use crate::lens::model::Lens;

/// Residuals below this are rounding, not errors of measurement, in px.
pub(super) const ROUNDING_PX: f64 = 1e-7;

/// Seen less predicted place, in px; NaN for points behind the camera.
pub(super) fn residual(lens: &Lens, pose: &BoardPose, point: &PlanarPoint) -> (f64, f64) {
    let [x, y, z] = pose.point_mm(point.x_mm, point.y_mm);
    if z <= 0.0 {
        return (f64::NAN, f64::NAN);
    }
    let (x_px, y_px) = lens.pixel(x / z, y / z);
    (point.x_px - x_px, point.y_px - y_px)
}

/// Squared distance between point and prediction, in px2.
pub(super) fn squared_distance(lens: &Lens, pose: &BoardPose, point: &PlanarPoint) -> f64 {
    let (dx, dy) = residual(lens, pose, point);
    dx * dx + dy * dy
}
