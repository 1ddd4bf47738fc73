//! From disparity to metric height.

use serde::Serialize;

use epirig_core::grid::Grid;
use epirig_core::statistics::upper_median;
use epirig_matcher::evaluate::HalfMaps;

/// The geometry from disparity to distance: an ideal pinhole camera and the length of the baseline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    /// Focal length of the camera without distortion, in px.
    pub focal_length_px: f64,
    /// Length of the baseline, from the first to the last frame, in mm.
    pub baseline_mm: f64,
    /// Principal point, column.
    pub principal_point_x_px: f64,
    /// Principal point, row.
    pub principal_point_y_px: f64,
    /// How well the scale of all distances, f b, is known. It is kept apart from the sigma of pixels: a wrong
    /// scale makes every step wrong by the same share, and averages out nowhere.
    pub scale: ScaleSigma,
}

/// Relative standard uncertainties of the factors of the scale of all distances; `None` is not known, and counts as
/// exact. A height is a difference of two distances f b / |d|, so it is wrong by the share by which f b is.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ScaleSigma {
    /// Of the focal length f.
    pub focal_length: Option<f64>,
    /// Of the length b of the baseline.
    pub baseline: Option<f64>,
}

impl ScaleSigma {
    /// Of both together, which are independent; 0 if both count as exact.
    pub fn together(self) -> f64 {
        self.focal_length.unwrap_or(0.0).hypot(self.baseline.unwrap_or(0.0))
    }

    /// The factors that count as exact, in words; `None` if there are none.
    pub fn taken_as_exact(self) -> Option<&'static str> {
        let is_exact = |sigma: Option<f64>| sigma.unwrap_or(0.0) == 0.0;
        match (is_exact(self.focal_length), is_exact(self.baseline)) {
            (true, true) => Some("focal length and baseline"),
            (true, false) => Some("focal length"),
            (false, true) => Some("baseline"),
            (false, false) => None,
        }
    }
}

impl Geometry {
    /// Whose scale counts as exact.
    pub fn exact(focal_length_px: f64, baseline_mm: f64, principal_point_px: (f64, f64)) -> Self {
        let (principal_point_x_px, principal_point_y_px) = principal_point_px;
        let scale = ScaleSigma::default();
        Self { focal_length_px, baseline_mm, principal_point_x_px, principal_point_y_px, scale }
    }

    /// Distance of a point with this disparity in px, in mm.
    fn distance_mm(&self, disparity_px: f32) -> f64 {
        (self.focal_length_px * self.baseline_mm).abs() / f64::from(disparity_px.abs())
    }

    /// The same, its scale as well known as this.
    #[must_use]
    pub fn with_scale(self, scale: ScaleSigma) -> Self {
        Self { scale, ..self }
    }
}

/// Distances and heights; rows x columns, NaN where there is no disparity.
#[derive(Debug, Clone, PartialEq)]
pub struct Heights {
    /// Height towards the camera over the level at `distance_mm`, in mm.
    pub height_mm: Grid<f32>,
    /// Its standard deviation, in mm, without that of the common scale.
    pub sigma_mm: Grid<f32>,
    /// Distance of the level that heights are counted from, along the optical axis, in mm: the median of all
    /// distances.
    pub distance_mm: f64,
    /// The geometry of the heights.
    pub geometry: Geometry,
}

impl Heights {
    /// Where the point seen at column `x` and row `y` lies, in mm in the camera's frame: X to the right, Y
    /// down; NaN where there is no height.
    ///
    /// # Panics
    /// If `x` or `y` lies outside the field.
    pub fn lateral_mm(&self, x: usize, y: usize) -> (f64, f64) {
        let per_pixel =
            (self.distance_mm - f64::from(self.height_mm.at(x, y))) / self.geometry.focal_length_px;
        let from = |pixel: usize, principal: f64| (pixel as f64 - principal) * per_pixel;
        (from(x, self.geometry.principal_point_x_px), from(y, self.geometry.principal_point_y_px))
    }

    /// The heights where `chosen`, which has their size; unknown elsewhere.
    #[must_use]
    pub fn only(&self, chosen: &Grid<bool>) -> Self {
        let masked =
            |map: &Grid<f32>| map.zip_map(chosen, |value, chosen| if chosen { value } else { f32::NAN });
        Self { height_mm: masked(&self.height_mm), sigma_mm: masked(&self.sigma_mm), ..*self }
    }

    /// Heights by half of the frames in the same view, counted from the same level.
    pub fn of_half(&self, half: &HalfMaps) -> HalfHeights {
        let of = |disparity: &Grid<f32>, sigma: &Grid<f32>| {
            over_level(self.geometry, self.distance_mm, disparity, sigma)
        };
        let ([disparity, sigma], equal) = (&half.best, &half.in_equal_discs);
        let measured = of(&equal.disparity, &equal.sigma);
        let locking_mm = equal.locking.as_ref().map(|bias| {
            // Of what remains without the bias.
            let true_px = equal.disparity.zip_map(bias, |px, bias| px - bias);
            let without = of(&true_px, &equal.sigma).height_mm;
            measured.height_mm.zip_map(&without, |mm, without| mm - without)
        });
        HalfHeights { dividing: of(disparity, sigma), measured, locking_mm }
    }

    /// The mean with other, independent heights of the same pixels; NaN where one of them is not known.
    #[must_use]
    pub(super) fn mean_with(&self, other: &Self) -> Self {
        let height_mm = self.height_mm.zip_map(&other.height_mm, |one, other| 0.5 * (one + other));
        let sigma_mm = self.sigma_mm.zip_map(&other.sigma_mm, |one, other| 0.5 * one.hypot(other));
        Self { height_mm, sigma_mm, ..self.clone() }
    }

    /// These heights with the sigma of other, independent ones of the same pixels. A sigma grows where its height
    /// departs from those around it, so weights by it would choose heights by their error.
    #[must_use]
    pub(super) fn with_sigma_of(&self, other: &Self) -> Self {
        Self { height_mm: self.height_mm.clone(), sigma_mm: other.sigma_mm.clone(), ..*self }
    }

    /// Width of a pixel's view of the level at `distance_mm`, in mm.
    pub fn pixel_mm(&self) -> f64 {
        self.distance_mm / self.geometry.focal_length_px
    }
}

/// Heights by half of the frames, whose noise is independent of that of the other half; both are counted from the
/// level of all frames.
#[derive(Debug, Clone, PartialEq)]
pub struct HalfHeights {
    /// Heights with as little noise as can be: they tell where the hollows are.
    pub dividing: Heights,
    /// Heights by windows of one size, which see walls only from near: they tell how deep the hollows are.
    pub measured: Heights,
    /// Errors of the measured heights by pixel locking, as predicted, in mm; `None` if they are not significant.
    pub locking_mm: Option<Grid<f32>>,
}

impl HalfHeights {
    /// The heights where `kept` is true; NaN elsewhere.
    #[must_use]
    pub fn only(&self, kept: &Grid<bool>) -> Self {
        Self {
            dividing: self.dividing.only(kept),
            measured: self.measured.only(kept),
            locking_mm: self.locking_mm.clone(),
        }
    }
}

/// Height of every pixel: its distance is Z = f b / |d|, and a small error of d acts on it by Z / |d|.
///
/// `None` if no pixel has a disparity other than zero.
///
/// ```
/// use epirig_core::grid::Grid;
/// use epirig_surface::{Geometry, heights};
///
/// let geometry = Geometry::exact(2844.0, 150.0, (1.0, 0.0));
/// let disparity = Grid::from_values(1, 3, vec![474.0, 474.0, 473.9]).unwrap();
/// let heights = heights(geometry, &disparity, &Grid::filled(1, 3, 0.01)).unwrap();
/// assert!((heights.distance_mm - 900.0).abs() < 1e-6);
/// assert!((heights.height_mm.at(2, 0) + 0.19).abs() < 0.001);
/// ```
pub fn heights(geometry: Geometry, disparity: &Grid<f32>, sigma: &Grid<f32>) -> Option<Heights> {
    let mut distances: Vec<f64> = disparity
        .values()
        .iter()
        .map(|&d| geometry.distance_mm(d))
        .filter(|distance| distance.is_finite())
        .collect();
    let distance_mm = upper_median(&mut distances)?;
    Some(over_level(geometry, distance_mm, disparity, sigma))
}

/// Heights over the level at `distance_mm`.
fn over_level(geometry: Geometry, distance_mm: f64, disparity: &Grid<f32>, sigma: &Grid<f32>) -> Heights {
    let finite = |value: f64| if value.is_finite() { value as f32 } else { f32::NAN };
    let height_mm = disparity.map(|d| finite(distance_mm - geometry.distance_mm(d)));
    let sigma_mm = sigma.zip_map(disparity, |sigma, d| {
        finite(f64::from(sigma) * geometry.distance_mm(d) / f64::from(d.abs()))
    });
    Heights { height_mm, sigma_mm, distance_mm, geometry }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_lie_where_the_pinhole_sees_them() {
        // f b = 2000 px * 100 mm. Two points at Z = 500 and 499 mm: d = 400 and 400.8016 px.
        let geometry = Geometry::exact(2000.0, 100.0, (0.0, 2.0));
        let disparity = Grid::from_values(1, 4, vec![400.0, -400.0, 200_000.0 / 499.0, f32::NAN]).unwrap();
        let found = heights(geometry, &disparity, &Grid::filled(1, 4, 0.02)).unwrap();
        assert_eq!(found.distance_mm, 500.0);
        assert_eq!(found.height_mm.at(1, 0), 0.0, "the sign of a disparity is the direction of the way");
        assert!((found.height_mm.at(2, 0) - 1.0).abs() < 1e-4);
        // dZ = Z / d * dd = 500 / 400 * 0.02.
        assert!((found.sigma_mm.at(0, 0) - 0.025).abs() < 1e-7);
        assert!(found.height_mm.at(3, 0).is_nan() && found.sigma_mm.at(3, 0).is_nan());
        // X = 2 px * 499 mm / 2000 px, Y = -2 px * 499 mm / 2000 px.
        let (x_mm, y_mm) = found.lateral_mm(2, 0);
        assert!((x_mm - 0.499).abs() < 1e-6 && (y_mm + 0.499).abs() < 1e-6);
        assert_eq!(found.pixel_mm(), 0.25);
    }

    #[test]
    fn the_scale_has_a_sigma_of_its_own() {
        let geometry = Geometry::exact(2000.0, 100.0, (0.0, 0.0));
        assert_eq!(geometry.scale.together(), 0.0);
        let known = ScaleSigma { focal_length: Some(0.003), baseline: Some(0.004) };
        assert!((geometry.with_scale(known).scale.together() - 0.005).abs() < 1e-12);
    }

    #[test]
    fn without_a_disparity_there_is_no_height() {
        let geometry = Geometry::exact(2000.0, 100.0, (0.0, 0.0));
        let sigma = Grid::filled(1, 2, 0.1);
        let disparity = Grid::from_values(1, 2, vec![f32::NAN, 0.0]).unwrap();
        assert_eq!(heights(geometry, &disparity, &sigma), None);
    }
}
