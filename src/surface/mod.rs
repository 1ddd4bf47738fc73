//! From disparity to metric height.

use crate::plane::Plane;

/// What turns a disparity into a distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    /// Focal length, in px.
    pub focal_length_px: f64,
    /// Length of the baseline, from the first to the last frame, in mm.
    pub baseline_mm: f64,
}

/// Distances and heights; rows x columns, NaN where there is no disparity.
#[derive(Debug, Clone, PartialEq)]
pub struct Heights {
    /// Height towards the camera over the level at `distance_mm`, in mm.
    pub height_mm: Plane<f32>,
    /// Its standard deviation, in mm.
    pub sigma_mm: Plane<f32>,
    /// Distance of the level that heights are counted from, along the optical axis, in mm: the median of all distances.
    pub distance_mm: f64,
}

/// Height of every pixel: its distance is Z = f b / |d|, and a small error of d acts on it by Z / |d|.
///
/// `None` if no pixel has a disparity other than zero.
///
/// ```
/// use epirig::plane::Plane;
/// use epirig::surface::{Geometry, heights};
///
/// let geometry = Geometry { focal_length_px: 2844.0, baseline_mm: 150.0 };
/// let disparity = Plane::from_values(1, 3, vec![474.0, 474.0, 473.9]).unwrap();
/// let heights = heights(geometry, &disparity, &Plane::filled(1, 3, 0.01)).unwrap();
/// assert!((heights.distance_mm - 900.0).abs() < 1e-6);
/// assert!((heights.height_mm.at(2, 0) + 0.19).abs() < 0.001);
/// ```
pub fn heights(geometry: Geometry, disparity: &Plane<f32>, sigma: &Plane<f32>) -> Option<Heights> {
    let reach = geometry.focal_length_px * geometry.baseline_mm;
    let distance = |disparity: f32| reach / f64::from(disparity.abs());
    let mut distances: Vec<f64> =
        disparity.values().iter().map(|&d| distance(d)).filter(|distance| distance.is_finite()).collect();
    if distances.is_empty() {
        return None;
    }
    let middle = distances.len() / 2;
    let distance_mm = *distances.select_nth_unstable_by(middle, f64::total_cmp).1;
    let finite = |value: f64| if value.is_finite() { value as f32 } else { f32::NAN };
    let height_mm = disparity.map(|d| finite(distance_mm - distance(d)));
    let mut sigma_mm = sigma.clone();
    for (sigma, &d) in sigma_mm.values_mut().iter_mut().zip(disparity.values()) {
        *sigma = finite(f64::from(*sigma) * distance(d) / f64::from(d.abs()));
    }
    Some(Heights { height_mm, sigma_mm, distance_mm })
}
