//! Coverage, angles and warnings of a calibration.

use epirig_core::statistics::upper_median;
use nalgebra::Vector3;

use super::calibration::{Coverage, PointResidual, ViewFit};
use super::error::LensWarning;
use super::point::ROUNDING_PX;
use super::pose::BoardPose;

/// Cells of the grid along a side.
const CELLS: usize = 10;
/// A focal length that is known worse than this is worth a word: heights are off by the same share.
const FOCAL_LENGTH_SHARE: f64 = 0.005;
/// A view whose residuals are this many times as large as the median view's stands out: those of 8 points,
/// the fewest, scatter by 20 %.
const STANDS_OUT: f64 = 2.0;
/// A view with a larger share of rejected points stands out.
const REJECTED: f64 = 0.1;
/// Below this share of the corner's radius more than half of the frame's squared radius is extrapolated.
const RADIUS: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Largest angle between the normals of any two boards, in rad.
pub(super) fn largest_angle(poses: &[BoardPose]) -> f64 {
    let normals: Vec<Vector3<f64>> = poses.iter().map(|pose| Vector3::from(pose.normal())).collect();
    let mut largest = 0.0_f64;
    for (index, first) in normals.iter().enumerate() {
        for second in &normals[..index] {
            // A board may be seen from behind if its axes are left-handed: then all of them are.
            largest = largest.max(first.cross(second).norm().atan2(first.dot(second)));
        }
    }
    largest
}

pub(super) fn coverage(residuals: &[Vec<PointResidual>], rows: usize, columns: usize) -> Coverage {
    let (width, height) = (columns as f64, rows as f64);
    let (cx, cy) = (0.5 * (width - 1.0), 0.5 * (height - 1.0));
    let mut reached = [[false; CELLS]; CELLS];
    let mut radius = 0.0_f64;
    for point in residuals.iter().flatten().filter(|point| !point.rejected) {
        radius = radius.max((point.x_px - cx).hypot(point.y_px - cy) / cx.hypot(cy));
        // Pixels reach half a pixel to each side of their centres.
        let cell = |place: f64, size: f64| {
            ((place + 0.5) / size * CELLS as f64).clamp(0.0, CELLS as f64 - 1.0) as usize
        };
        reached[cell(point.y_px, height)][cell(point.x_px, width)] = true;
    }
    let cells = reached.iter().flatten().filter(|reached| **reached).count();
    Coverage { cells: cells as f64 / (CELLS * CELLS) as f64, radius }
}

pub(super) fn warnings(
    sigma_share: f64,
    spread_rad: f64,
    views: &[ViewFit],
    coverage: &Coverage,
) -> Vec<LensWarning> {
    let mut warnings = Vec::new();
    if sigma_share > FOCAL_LENGTH_SHARE {
        warnings.push(LensWarning::FocalLengthOpen { sigma_share, spread_rad });
    }
    let typical_px =
        upper_median(&mut views.iter().map(|view| view.rms_px).collect::<Vec<f64>>()).unwrap_or(f64::NAN);
    for (view, &ViewFit { rms_px, points, rejected }) in views.iter().enumerate() {
        let worse = rms_px > (STANDS_OUT * typical_px).max(ROUNDING_PX);
        if worse || rejected as f64 > REJECTED * points as f64 {
            warnings.push(LensWarning::ViewStandsOut { view, rms_px, typical_px, rejected, points });
        }
    }
    if coverage.radius < RADIUS {
        warnings.push(LensWarning::CornersNotReached { radius: coverage.radius });
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_counts_cells_and_the_farthest_point() {
        let point = |x_px, y_px, rejected| PointResidual { x_px, y_px, dx_px: 0.0, dy_px: 0.0, rejected };
        // A frame of 100 x 200: cells of 10 x 20. The first two points share a cell; a point at (149, 74) is
        // half-way to the corner.
        let residuals = vec![
            vec![point(100.0, 50.0, false), point(101.0, 51.0, false)],
            vec![point(149.25, 74.25, false), point(0.0, 0.0, true)],
        ];
        let found = coverage(&residuals, 100, 200);
        assert_eq!(found.cells, 0.02);
        assert!((found.radius - 0.5).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn boards_turned_by_half_a_radian_differ_by_that() {
        let pose = |rotation_rad| BoardPose { rotation_rad, translation_mm: [0.0, 0.0, 500.0] };
        let poses = [pose([0.2, 0.0, 0.0]), pose([-0.3, 0.0, 0.0]), pose([0.0, 0.0, 2.0])];
        assert!((largest_angle(&poses) - 0.5).abs() < 1e-12);
    }
}
