//! Points of a flat board as a frame shows them, and how far they are from where they are predicted.

use serde::{Deserialize, Serialize};

use super::pose::BoardPose;
use crate::lens::model::Lens;

/// Residuals below this are rounding, not errors of measurement, in px.
pub(super) const ROUNDING_PX: f64 = 1e-7;

/// A point of a flat board and where it was seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanarPoint {
    /// Place on the board, in mm.
    pub x_mm: f64,
    /// Place on the board, in mm.
    pub y_mm: f64,
    /// Column where it was seen, in px.
    pub x_px: f64,
    /// Row where it was seen, in px.
    pub y_px: f64,
    /// Standard deviation of column and row each, in px; above 0. A common factor does not matter.
    pub sigma_px: f64,
}

/// The points of the board that one frame shows; at least eight that are not on a line. They need not be all.
pub type View = Vec<PlanarPoint>;

/// Mean of the points on the board, in mm. Homographies are taken about it: the board's own origin may lie
/// far off, even behind the camera.
pub(super) fn middle(points: &[PlanarPoint]) -> [f64; 2] {
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.x_mm, y + point.y_mm));
    [x / count, y / count]
}

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
