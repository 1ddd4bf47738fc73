//! The start of a lens calibration, in closed form.

use epirig_core::statistics::upper_median;
use nalgebra::Matrix3;

use super::error::LensError;
use super::homography::{Pair, homography};
use super::point::{View, middle, squared_distance};
use super::pose::BoardPose;
use crate::lens::model::Lens;

/// Lens and poses by Zhang's (2000) constraints, with square pixels and the principal point in the middle of
/// the frame: all five parameters of the general form are poorly determined where the perspective is weak,
/// and a start need not have them.
pub(super) fn start(
    views: &[View],
    rows: usize,
    columns: usize,
) -> Result<(Lens, Vec<BoardPose>), LensError> {
    let (cx, cy) = (0.5 * (columns as f64 - 1.0), 0.5 * (rows as f64 - 1.0));
    let mut homographies = Vec::with_capacity(views.len());
    for (view, points) in views.iter().enumerate() {
        let middle = middle(points);
        let pairs: Vec<Pair> = points
            .iter()
            .map(|point| Pair {
                from: [point.x_mm - middle[0], point.y_mm - middle[1]],
                to: [point.x_px - cx, point.y_px - cy],
            })
            .collect();
        homographies.push(homography(&pairs).ok_or(LensError::OnALine { view })?);
    }
    // All views together say it best, unless one is wrong: then any other says it better.
    let alone = homographies.iter().filter_map(|homography| focal_length(std::slice::from_ref(homography)));
    let mut best: Option<(f64, Lens, Vec<BoardPose>)> = None;
    for focal_length_px in focal_length(&homographies).into_iter().chain(alone) {
        let lens = Lens::pinhole(focal_length_px, cx, cy);
        let Some(poses) = poses(&lens, &homographies, views) else { continue };
        let distance = typical_distance(views, &lens, &poses);
        if best.as_ref().is_none_or(|(least, ..)| distance < *least) {
            best = Some((distance, lens, poses));
        }
    }
    let alike = LensError::PosesAlike { sigma_share: None, spread_rad: None };
    best.map(|(_, lens, poses)| (lens, poses)).ok_or(alike)
}

fn poses(lens: &Lens, homographies: &[Matrix3<f64>], views: &[View]) -> Option<Vec<BoardPose>> {
    let scale = 1.0 / lens.focal_length_x_px;
    let scale = Matrix3::from_diagonal(&[scale, scale, 1.0].into());
    let pose = |(homography, points): (&Matrix3<f64>, &View)| {
        Some(BoardPose::from_homography(&(scale * homography))?.with_origin_moved_by(middle(points)))
    };
    homographies.iter().zip(views).map(pose).collect()
}

/// Median distance between points and predictions, in px; infinite for points behind the camera.
fn typical_distance(views: &[View], lens: &Lens, poses: &[BoardPose]) -> f64 {
    let of = |(view, pose): (&View, &BoardPose)| -> Vec<f64> {
        view.iter().map(|point| squared_distance(lens, pose, point).sqrt()).collect()
    };
    // NaN is sorted behind all numbers.
    let mut distances: Vec<f64> = views.iter().zip(poses).flat_map(of).map(f64::abs).collect();
    upper_median(&mut distances).unwrap_or(f64::NAN)
}

/// Both axes of a board are perpendicular and equally long, which every view says of the focal length f: with
/// h and g the first columns of its homography, (h1 g1 + h2 g2) / f^2 + h3 g3 = 0, and (h1^2 + h2^2 - g1^2 -
/// g2^2) / f^2 + h3^2 - g3^2 = 0. `None` if the views say that 1 / f^2 is not above 0.
fn focal_length(homographies: &[Matrix3<f64>]) -> Option<f64> {
    let (mut products, mut squares) = (0.0, 0.0);
    for homography in homographies {
        // Views count alike, however far off the board is.
        let scaled = homography / homography.fixed_view::<2, 2>(0, 0).norm();
        let (h, g) = (scaled.column(0), scaled.column(1));
        for (factor, constant) in [
            (h[0] * g[0] + h[1] * g[1], h[2] * g[2]),
            (
                0.5 * (h[0] * h[0] + h[1] * h[1] - g[0] * g[0] - g[1] * g[1]),
                0.5 * (h[2] * h[2] - g[2] * g[2]),
            ),
        ] {
            products -= factor * constant;
            squares += factor * factor;
        }
    }
    let focal_length = (squares / products).sqrt();
    (focal_length.is_finite() && focal_length > 0.0).then_some(focal_length)
}
