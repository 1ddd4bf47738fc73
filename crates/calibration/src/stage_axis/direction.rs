//! The direction of the stage axis, as the two angles that rectify it.

use serde::{Deserialize, Serialize};

/// The rotation R = Ry(pan) Rz(roll) that makes the stage axis the x axis: a rotation about the optical axis,
/// then a pan (paper, section 5.2).
///
/// A ray r of the camera is R r in the rectified frame.
///
/// ```
/// use epirig_calibration::stage_axis::Direction;
///
/// let direction = Direction::of([1.0, -0.0122, 0.0070]).unwrap();
/// assert!((direction.roll_rad - 0.0122).abs() < 1e-5 && (direction.pan_rad - 0.0070).abs() < 1e-5);
/// let [x, y, z] = direction.rectified([1.0, -0.0122, 0.0070]);
/// assert!(x > 0.0 && y.abs() < 1e-15 && z.abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Direction {
    /// Rotation about the optical axis, in rad.
    pub roll_rad: f64,
    /// Rotation about the vertical axis after that, in rad.
    pub pan_rad: f64,
}

/// A ray of the camera with its derivatives.
pub(super) struct RawRay {
    /// The ray (a, b, 1).
    pub(super) ray: [f64; 2],
    /// Derivatives of (a, b) by roll, pan, and the rectified x and y.
    pub(super) derivatives: [[f64; 4]; 2],
}

impl Direction {
    /// The stage axis `v` in the frame of the camera; `None` if it is not along x rather than along y or the
    /// optical axis. A vector that points to negative x is the same axis, backwards.
    pub fn of(v: [f64; 3]) -> Option<Self> {
        let length = v.iter().map(|value| value * value).sum::<f64>().sqrt();
        let forwards = v.map(|value| value * v[0].signum() / length);
        let along_x = forwards[0] > std::f64::consts::FRAC_1_SQRT_2;
        along_x.then(|| Self { roll_rad: -forwards[1].atan2(forwards[0]), pan_rad: forwards[2].asin() })
    }

    /// A vector of the camera's frame in the rectified frame.
    pub fn rectified(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let ((sin_roll, cos_roll), (sin_pan, cos_pan)) = (self.roll_rad.sin_cos(), self.pan_rad.sin_cos());
        let (u, v) = (cos_roll * x - sin_roll * y, sin_roll * x + cos_roll * y);
        [cos_pan * u + sin_pan * z, v, cos_pan * z - sin_pan * u]
    }

    /// The ray (x, y, 1) of the rectified frame, seen in the camera's frame.
    pub(super) fn raw(&self, x: f64, y: f64) -> RawRay {
        let ((sin_roll, cos_roll), (sin_pan, cos_pan)) = (self.roll_rad.sin_cos(), self.pan_rad.sin_cos());
        let unrolled = |[u, v, w]: [f64; 3]| [cos_roll * u + sin_roll * v, cos_roll * v - sin_roll * u, w];
        let panned = [cos_pan * x - sin_pan, y, sin_pan * x + cos_pan];
        let [u, v, w] = unrolled(panned);
        let (a, b) = (u / w, v / w);
        let quotient = |[du, dv, dw]: [f64; 3]| [(du - a * dw) / w, (dv - b * dw) / w];
        let by_roll = quotient([v, -u, 0.0]);
        let by_pan = quotient(unrolled([-sin_pan * x - cos_pan, 0.0, cos_pan * x - sin_pan]));
        let by_x = quotient(unrolled([cos_pan, 0.0, sin_pan]));
        let by_y = quotient(unrolled([0.0, 1.0, 0.0]));
        let derivatives = [0, 1].map(|axis| [by_roll[axis], by_pan[axis], by_x[axis], by_y[axis]]);
        RawRay { ray: [a, b], derivatives }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_agree_with_differences_and_the_way_back_is_the_inverse() {
        let at = [0.012, -0.2, 0.3, 0.15];
        let ray = |[roll_rad, pan_rad, x, y]: [f64; 4]| Direction { roll_rad, pan_rad }.raw(x, y);
        let here = ray(at);
        for index in 0..4 {
            let moved = |step: f64| {
                let mut moved = at;
                moved[index] += step;
                ray(moved).ray
            };
            let (ahead, behind) = (moved(1e-6), moved(-1e-6));
            for axis in 0..2 {
                let difference = (ahead[axis] - behind[axis]) / 2e-6;
                assert!((here.derivatives[axis][index] - difference).abs() < 1e-8);
            }
        }
        let [x, y, z] =
            Direction { roll_rad: at[0], pan_rad: at[1] }.rectified([here.ray[0], here.ray[1], 1.0]);
        assert!((x / z - at[2]).abs() < 1e-14 && (y / z - at[3]).abs() < 1e-14);
    }

    #[test]
    fn the_rotation_is_that_of_its_matrices() {
        use nalgebra::{Rotation3, Vector3};
        let (roll, pan) = (0.3, -0.2);
        let matrix = Rotation3::from_axis_angle(&Vector3::y_axis(), pan)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), roll);
        let expected = matrix * Vector3::new(0.4, -0.7, 1.1);
        let found = Direction { roll_rad: roll, pan_rad: pan }.rectified([0.4, -0.7, 1.1]);
        assert!((0..3).all(|axis| (found[axis] - expected[axis]).abs() < 1e-14));
    }
}
