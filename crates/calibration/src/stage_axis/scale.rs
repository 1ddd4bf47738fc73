//! The stage's scale, compared with the size of the target's squares.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::AxisPoint;
use crate::target::{Target, Tracks};

/// Length of the baseline as the target's squares and as the stage tell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetScale {
    /// Length of the baseline, if the squares have the stated size, in mm.
    pub baseline_mm: f64,
    /// Its length by the stage, in mm.
    pub reported_mm: f64,
}

impl TargetScale {
    /// Difference between the baseline by the target and that by the stage, as a share of it.
    pub fn contradiction(&self) -> f64 {
        self.baseline_mm / self.reported_mm - 1.0
    }
}

/// Length of the baseline, in mm, for which the target's boards, seen by triangulation over it, have their
/// stated size.
///
/// A point with disparity d over the baseline b lies at depth b / d (all over the focal length), so
/// triangulated boards have a size in units of the baseline, whatever the focal length along the depth; each
/// band is compared on its own, because only its squares are known well. `None` if no band shows corners at
/// different places.
pub fn baseline_by_target(points: &[AxisPoint], tracks: &Tracks, target: &Target) -> Option<f64> {
    let (mut stated, mut seen) = (0.0, 0.0);
    for band in 0..target.bands {
        let of_band: Vec<[Vector3<f64>; 2]> = points
            .iter()
            .filter(|point| tracks.corners[point.corner].band == band)
            .map(|point| {
                let corner = tracks.corners[point.corner];
                let square = target.board.square_mm;
                let printed =
                    Vector3::new(f64::from(corner.column) * square, f64::from(corner.row) * square, 0.0);
                [printed, Vector3::new(point.x, point.y, 1.0) / point.disparity.abs()]
            })
            .collect();
        if of_band.is_empty() {
            continue;
        }
        // How far all points lie from their middle, squared: as printed, and as placed.
        let [printed, placed] = [0, 1].map(|of| {
            let middle = of_band.iter().map(|pair| pair[of]).sum::<Vector3<f64>>() / of_band.len() as f64;
            of_band.iter().map(|pair| (pair[of] - middle).norm_squared()).sum::<f64>()
        });
        stated += printed;
        seen += placed;
    }
    (stated > 0.0 && seen > 0.0).then(|| (stated / seen).sqrt())
}
