//! Where a rectified pixel lies in the raw image, and back.

use serde::{Deserialize, Serialize};

use crate::lens::{Distortion, Lens};

/// The rectified camera: an ideal pinhole camera with square pixels, from which the volume is seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RectifiedCamera {
    /// Rows of its images.
    pub rows: usize,
    /// Columns of its images.
    pub columns: usize,
    /// Focal length, in px.
    pub focal_length_px: f64,
    /// Column of the principal point, in px; it may lie outside the image.
    pub principal_point_x_px: f64,
    /// Row of the principal point, in px; it may lie outside the image.
    pub principal_point_y_px: f64,
}

impl RectifiedCamera {
    /// The ray (a, b, 1) that is seen at column `x_px` and row `y_px`.
    pub fn ray(&self, x_px: f64, y_px: f64) -> (f64, f64) {
        (
            (x_px - self.principal_point_x_px) / self.focal_length_px,
            (y_px - self.principal_point_y_px) / self.focal_length_px,
        )
    }

    /// Where the ray (a, b, 1) is seen: column and row, in px.
    pub fn pixel(&self, a: f64, b: f64) -> (f64, f64) {
        (
            self.focal_length_px * a + self.principal_point_x_px,
            self.focal_length_px * b + self.principal_point_y_px,
        )
    }
}

/// The one map from raw images to rectified ones: lens, roll, pan and the rectified camera.
///
/// A ray r of the raw camera is R r in the rectified one, R = Ry(pan) Rz(roll); there the scene moves along x
/// alone.
///
/// ```
/// use epirig_calibration::lens::Lens;
/// use epirig_calibration::rectification::Mapping;
///
/// let lens = Lens::pinhole(1000.0, 319.5, 239.5);
/// let straight = Mapping::fitting(lens, 0.0, 0.0, 480, 640)?;
/// assert_eq!(straight.raw(10.0, 20.0), (10.0, 20.0));
/// let turned = Mapping::fitting(lens, 0.01, 0.0, 480, 640)?;
/// assert!(turned.camera.columns < 640 && turned.camera.rows < 480);
/// # Ok::<(), epirig_calibration::rectification::RectifyError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mapping {
    /// The lens of the raw frames.
    pub lens: Lens,
    /// Turn about the optical axis, from the raw to the rectified camera, in rad.
    pub roll_rad: f64,
    /// Turn about the vertical axis after that, in rad.
    pub pan_rad: f64,
    /// Rows of the raw frames.
    pub raw_rows: usize,
    /// Columns of the raw frames.
    pub raw_columns: usize,
    /// The rectified camera.
    pub camera: RectifiedCamera,
}

impl Mapping {
    /// R = Ry(pan) Rz(roll), row by row: a ray of the raw camera becomes R times it.
    pub fn rotation(&self) -> [[f64; 3]; 3] {
        let (roll_sin, roll_cos) = self.roll_rad.sin_cos();
        let (pan_sin, pan_cos) = self.pan_rad.sin_cos();
        [
            [pan_cos * roll_cos, -pan_cos * roll_sin, pan_sin],
            [roll_sin, roll_cos, 0.0],
            [-pan_sin * roll_cos, pan_sin * roll_sin, pan_cos],
        ]
    }

    /// Where the rectified pixel (`x_px`, `y_px`) lies in the raw image: column and row. NaN if its ray comes
    /// from behind the camera.
    pub fn raw(&self, x_px: f64, y_px: f64) -> (f64, f64) {
        if self.is_identity() {
            return (x_px, y_px);
        }
        let (a, b) = self.raw_ray(&self.rotation(), x_px, y_px);
        self.lens.pixel(a, b)
    }

    /// Where the raw pixel (`x_px`, `y_px`) lies in the rectified image: column and row; `None` where the
    /// lens's distortion cannot be undone, or the ray comes from behind the rectified camera.
    pub fn rectified(&self, x_px: f64, y_px: f64) -> Option<(f64, f64)> {
        if self.is_identity() {
            return Some((x_px, y_px));
        }
        let (a, b) = self.lens.ray(x_px, y_px)?;
        let [x, y, z] = self.rotation().map(|row| row[0] * a + row[1] * b + row[2]);
        (z > 0.0).then(|| self.camera.pixel(x / z, y / z))
    }

    /// Whether raw pixels are rectified pixels as they are.
    pub fn is_identity(&self) -> bool {
        let Self { lens, camera, .. } = self;
        self.roll_rad == 0.0
            && self.pan_rad == 0.0
            && lens.distortion == Distortion::default()
            && [lens.focal_length_x_px, lens.focal_length_y_px] == [camera.focal_length_px; 2]
            && lens.principal_point_x_px == camera.principal_point_x_px
            && lens.principal_point_y_px == camera.principal_point_y_px
    }

    /// The ray (a, b, 1) of the raw camera that becomes the rectified pixel; `rotation` is
    /// [`Self::rotation`].
    pub(super) fn raw_ray(&self, rotation: &[[f64; 3]; 3], x_px: f64, y_px: f64) -> (f64, f64) {
        let (a, b) = self.camera.ray(x_px, y_px);
        let [first, second, third] = rotation;
        let [x, y, z] = [0, 1, 2].map(|axis| first[axis] * a + second[axis] * b + third[axis]);
        if z > 0.0 { (x / z, y / z) } else { (f64::NAN, f64::NAN) }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3, Vector3};
    use proptest::prelude::*;

    use super::*;

    fn mapping(roll_rad: f64, pan_rad: f64, distortion: Distortion) -> Mapping {
        let lens = Lens::from_array([1400.0, 1380.0, 500.0, 390.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let camera = RectifiedCamera {
            rows: 768,
            columns: 1024,
            focal_length_px: 1390.0,
            principal_point_x_px: 511.0,
            principal_point_y_px: 380.0,
        };
        let lens = Lens { distortion, ..lens };
        Mapping { lens, roll_rad, pan_rad, raw_rows: 768, raw_columns: 1024, camera }
    }

    proptest! {
        #[test]
        fn there_and_back_is_the_same_pixel(
            x in 0.0..1024.0, y in 0.0..768.0, roll in -0.3..0.3, pan in -0.3..0.3, k1 in -0.2..0.2, p in -0.005..0.005,
        ) {
            let mapping = mapping(roll, pan, Distortion { k1, k2: 0.05, p1: p, p2: -0.5 * p, k3: 0.0 });
            let (raw_x, raw_y) = mapping.raw(x, y);
            let (again_x, again_y) = mapping.rectified(raw_x, raw_y).unwrap();
            prop_assert!((again_x - x).abs() < 1e-9 && (again_y - y).abs() < 1e-9, "{again_x} {again_y}");
        }

        #[test]
        fn without_distortion_it_is_a_homography(
            x in 0.0..1024.0, y in 0.0..768.0, roll in -0.3..0.3, pan in -0.3..0.3,
        ) {
            let mapping = mapping(roll, pan, Distortion::default());
            let (lens, camera) = (mapping.lens, mapping.camera);
            let raw = Matrix3::new(
                lens.focal_length_x_px, 0.0, lens.principal_point_x_px,
                0.0, lens.focal_length_y_px, lens.principal_point_y_px,
                0.0, 0.0, 1.0,
            );
            let ideal = Matrix3::new(
                camera.focal_length_px, 0.0, camera.principal_point_x_px,
                0.0, camera.focal_length_px, camera.principal_point_y_px,
                0.0, 0.0, 1.0,
            );
            let rotation = Rotation3::from_axis_angle(&Vector3::y_axis(), pan)
                * Rotation3::from_axis_angle(&Vector3::z_axis(), roll);
            let homography = ideal * rotation.matrix() * raw.try_inverse().unwrap();
            let seen = homography * Vector3::new(x, y, 1.0);
            let (found_x, found_y) = mapping.rectified(x, y).unwrap();
            prop_assert!((found_x - seen.x / seen.z).abs() < 1e-9 && (found_y - seen.y / seen.z).abs() < 1e-9);
        }
    }

    #[test]
    fn rays_from_behind_are_seen_nowhere() {
        let mapping = mapping(0.0, 2.0, Distortion::default());
        assert!(mapping.raw(511.0, 380.0).0.is_nan());
        assert_eq!(mapping.rectified(500.0, 390.0), None);
    }

    #[test]
    fn it_comes_back_from_a_record_and_unknown_keys_are_refused() {
        let mapping = mapping(0.012, -0.007, Distortion { k1: -0.02, ..Distortion::default() });
        let text = serde_json::to_string(&mapping).unwrap();
        assert_eq!(serde_json::from_str::<Mapping>(&text).unwrap(), mapping);
        assert!(serde_json::from_str::<Mapping>(&text.replace("roll_rad", "roll_deg")).is_err());
    }
}
