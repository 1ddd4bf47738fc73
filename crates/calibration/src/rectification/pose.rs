//! How the camera of one frame departs from the mean camera, and where a pixel lies in that frame.

use serde::{Deserialize, Serialize};

use super::Mapping;

/// The camera of one frame, relative to the common raw camera: the one in the mean orientation.
///
/// A ray x = (u, v, 1) of the common raw camera is seen in this frame along
///
/// ```text
/// y ~ Rot(rotation_rad) (x - offset)
/// ```
///
/// Without an offset this holds for points at every distance. With one it holds for points at the typical
/// distance; others are off by the offset times the difference of the inverse depths, as a share of the
/// typical one. The default is the common camera itself.
///
/// ```
/// use epirig_calibration::rectification::FramePose;
///
/// let roll = FramePose { rotation_rad: [0.0, 0.0, 0.01], ..FramePose::default() };
/// let [first, second, _] = roll.matrix();
/// assert!((first[1] + 0.01_f64.sin()).abs() < 1e-15 && (second[1] - 0.01_f64.cos()).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FramePose {
    /// Rotation vector: its direction is the axis in the raw camera's frame (x to the right, y down, z into
    /// the scene), its length the angle in rad, which turns x to y, y to z and z to x.
    pub rotation_rad: [f64; 3],
    /// Displacement of the camera across the path, times the inverse depth of a typical point; no unit. Its z
    /// is below 1: the point is in front of the camera.
    pub offset: [f64; 3],
}

impl FramePose {
    /// The map of rays, row by row: y ~ M x, with M = Rot(rotation) (I - offset e_z^T).
    pub fn matrix(&self) -> [[f64; 3]; 3] {
        self.rotation().map(|row| {
            let moved = dot(row, self.offset);
            [row[0], row[1], row[2] - moved]
        })
    }

    /// Rot(rotation), row by row (Rodrigues).
    fn rotation(&self) -> [[f64; 3]; 3] {
        let [x, y, z] = self.rotation_rad;
        let angle = dot(self.rotation_rad, self.rotation_rad).sqrt();
        // sin(t) / t and (1 - cos(t)) / t^2, the latter without the difference of nearly equal numbers.
        let sinc = |t: f64| if t == 0.0 { 1.0 } else { t.sin() / t };
        let (first, second) = (sinc(angle), 0.5 * sinc(0.5 * angle) * sinc(0.5 * angle));
        let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
        let columns = [0, 1, 2].map(|column| cross.map(|row| row[column]));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let unit = if i == j { 1.0 } else { 0.0 };
                unit + first * cross[i][j] + second * dot(cross[i], columns[j])
            })
        })
    }

    /// The ray of the frame along which the ray (a, b, 1) of the common raw camera is seen; NaN behind it.
    fn ray(&self, a: f64, b: f64) -> (f64, f64) {
        let [x, y, z] = self.matrix().map(|row| dot(row, [a, b, 1.0]));
        if z > 0.0 { (x / z, y / z) } else { (f64::NAN, f64::NAN) }
    }

    /// The ray of the common raw camera that is seen along (a, b, 1) in the frame: the inverse of
    /// [`Self::ray`].
    fn common_ray(&self, a: f64, b: f64) -> Option<(f64, f64)> {
        let rotation = self.rotation();
        let turned: [f64; 3] = std::array::from_fn(|axis| dot(rotation.map(|row| row[axis]), [a, b, 1.0]));
        // (I - d e_z^T)^-1 = I + d e_z^T / (1 - d_z).
        let depth = turned[2] / (1.0 - self.offset[2]);
        let seen = turned[2] > 0.0 && depth > 0.0;
        seen.then(|| (turned[0] / depth + self.offset[0], turned[1] / depth + self.offset[1]))
    }
}

impl Mapping {
    /// Where the rectified pixel (`x_px`, `y_px`) lies in a raw frame of this pose: column and row. NaN if
    /// its ray comes from behind one of the cameras.
    pub fn raw_of(&self, pose: &FramePose, x_px: f64, y_px: f64) -> (f64, f64) {
        if *pose == FramePose::default() {
            return self.raw(x_px, y_px);
        }
        let (a, b) = self.raw_ray(&self.rotation(), x_px, y_px);
        let (a, b) = pose.ray(a, b);
        self.lens.pixel(a, b)
    }

    /// Where the pixel (`x_px`, `y_px`) of a raw frame of this pose lies in the rectified image: column and
    /// row; `None` where the lens's distortion cannot be undone, or the ray comes from behind one of the
    /// cameras.
    pub fn rectified_of(&self, pose: &FramePose, x_px: f64, y_px: f64) -> Option<(f64, f64)> {
        if *pose == FramePose::default() {
            return self.rectified(x_px, y_px);
        }
        let (a, b) = self.lens.ray(x_px, y_px)?;
        let (a, b) = pose.common_ray(a, b)?;
        let [x, y, z] = self.rotation().map(|row| dot(row, [a, b, 1.0]));
        (z > 0.0).then(|| self.camera.pixel(x / z, y / z))
    }
}

/// Scalar product.
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::{Matrix3, Rotation3, Vector3};
    use proptest::array::uniform3;
    use proptest::prelude::*;

    use super::*;
    use crate::lens::{Distortion, Lens};
    use crate::rectification::RectifiedCamera;

    fn mapping(roll_rad: f64, pan_rad: f64, k1: f64) -> Mapping {
        let distortion = Distortion { k1, ..Distortion::default() };
        let lens = Lens::from_array([1400.0, 1380.0, 500.0, 390.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let camera = RectifiedCamera {
            rows: 768,
            columns: 1024,
            focal_length_px: 1390.0,
            principal_point_x_px: 511.0,
            principal_point_y_px: 380.0,
        };
        Mapping {
            lens: Lens { distortion, ..lens },
            roll_rad,
            pan_rad,
            raw_rows: 768,
            raw_columns: 1024,
            camera,
        }
    }

    proptest! {
        #[test]
        fn there_and_back_is_the_same_pixel(
            x in 0.0..1024.0, y in 0.0..768.0, roll in -PI..PI, pan in -0.5..0.5, k1 in -0.1..0.1,
            rotation_rad in uniform3(-0.01..0.01), offset in uniform3(-0.01..0.01),
        ) {
            let mapping = mapping(roll, pan, k1);
            let pose = FramePose { rotation_rad, offset };
            let (raw_x, raw_y) = mapping.raw_of(&pose, x, y);
            let (again_x, again_y) = mapping.rectified_of(&pose, raw_x, raw_y).unwrap();
            prop_assert!((again_x - x).abs() < 1e-8 && (again_y - y).abs() < 1e-8, "{again_x} {again_y}");
        }

        #[test]
        fn rays_go_through_the_matrix_of_the_formula(
            a in -0.5..0.5, b in -0.5..0.5, rotation in uniform3(-0.5..0.5), offset in uniform3(-0.3..0.3),
            size in 0..4,
        ) {
            // Also angles so small that their squares vanish, and none.
            let rotation_rad = rotation.map(|angle: f64| [1.0, 1e-6, 1e-170, 0.0][size as usize] * angle);
            let pose = FramePose { rotation_rad, offset };
            let turn = Rotation3::new(Vector3::from(rotation_rad));
            let moved = Matrix3::identity() - Vector3::from(offset) * Vector3::z().transpose();
            let expected = turn.matrix() * moved;
            for (i, row) in pose.matrix().iter().enumerate() {
                for (j, value) in row.iter().enumerate() {
                    prop_assert!((value - expected[(i, j)]).abs() < 1e-14, "{i} {j}: {value}");
                }
            }
            let seen = turn * (Vector3::new(a, b, 1.0) - Vector3::from(offset));
            let (u, v) = pose.ray(a, b);
            prop_assert_eq!(u.is_nan(), seen.z <= 0.0);
            let error = (u - seen.x / seen.z).abs() + (v - seen.y / seen.z).abs();
            prop_assert!(u.is_nan() || error < 1e-12 * (1.0 + seen.norm() / seen.z.powi(2)), "{error}");
        }
    }

    #[test]
    fn what_is_behind_a_camera_is_seen_nowhere() {
        let mapping = mapping(0.3, 0.0, 0.0);
        let behind = FramePose { offset: [0.0, 0.0, 1.5], ..FramePose::default() };
        assert!(mapping.raw_of(&behind, 511.0, 380.0).0.is_nan());
        assert_eq!(mapping.rectified_of(&behind, 500.0, 390.0), None);
        let turned = FramePose { rotation_rad: [0.0, 2.0, 0.0], ..FramePose::default() };
        assert!(mapping.raw_of(&turned, 511.0, 380.0).0.is_nan());
        assert_eq!(mapping.rectified_of(&turned, 500.0, 390.0), None);
    }

    #[test]
    fn the_common_camera_sees_what_the_mapping_says() {
        let mapping = mapping(0.3, -0.1, -0.05);
        let pose = FramePose::default();
        assert_eq!(mapping.raw_of(&pose, 17.0, 40.0), mapping.raw(17.0, 40.0));
        assert_eq!(mapping.rectified_of(&pose, 17.0, 40.0), mapping.rectified(17.0, 40.0));
    }

    #[test]
    fn it_comes_back_from_a_record_and_unknown_keys_are_refused() {
        let pose = FramePose { rotation_rad: [1e-3, -2e-4, 3e-5], offset: [0.0, 0.01, -0.002] };
        let text = serde_json::to_string(&pose).unwrap();
        assert_eq!(serde_json::from_str::<FramePose>(&text).unwrap(), pose);
        assert!(serde_json::from_str::<FramePose>(&text.replace("rotation_rad", "rotation_deg")).is_err());
    }
}
