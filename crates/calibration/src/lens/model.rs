//! From rays to pixels and back.

use serde::{Deserialize, Serialize};

use super::Distortion;

/// Focal lengths, principal point and distortion.
///
/// Rays are (a, b, 1) = (X / Z, Y / Z, 1) in the frame of the camera: x to the right, y down, z into the
/// scene.
///
/// ```
/// use epirig_calibration::lens::{Distortion, Lens};
///
/// let distortion = Distortion { k1: -0.02, ..Distortion::default() };
/// let lens = Lens { distortion, ..Lens::pinhole(2844.0, 511.5, 511.5) };
/// let (x, y) = lens.pixel(0.1, -0.05);
/// assert!((x - (511.5 + 284.4 * (1.0 - 0.02 * 0.0125))).abs() < 1e-9);
/// let (a, b) = lens.ray(x, y).unwrap();
/// assert!((a - 0.1).abs() < 1e-12 && (b + 0.05).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lens {
    /// Focal length along x, in px.
    pub focal_length_x_px: f64,
    /// Focal length along y, in px.
    pub focal_length_y_px: f64,
    /// Column of the principal point, in px.
    pub principal_point_x_px: f64,
    /// Row of the principal point, in px.
    pub principal_point_y_px: f64,
    /// How rays depart from straight projection.
    pub distortion: Distortion,
}

/// A pixel with its derivatives by the ray and by the lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Column, in px.
    pub x_px: f64,
    /// Row, in px.
    pub y_px: f64,
    /// Derivatives of (x, y) by the ray's (a, b).
    pub by_ray: [[f64; 2]; 2],
    /// Derivatives of (x, y) by the lens's parameters, in the order of [`Lens::to_array`].
    pub by_lens: [[f64; Lens::PARAMETERS]; 2],
}

impl Lens {
    /// Number of parameters.
    pub const PARAMETERS: usize = 9;
    /// Their names, in the order of [`Self::to_array`], which is OpenCV's.
    pub const NAMES: [&'static str; Self::PARAMETERS] =
        ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"];

    /// A lens without distortion.
    pub fn pinhole(focal_length_px: f64, principal_point_x_px: f64, principal_point_y_px: f64) -> Self {
        Self {
            focal_length_x_px: focal_length_px,
            focal_length_y_px: focal_length_px,
            principal_point_x_px,
            principal_point_y_px,
            distortion: Distortion::default(),
        }
    }

    /// Where the ray (a, b, 1) is seen: column and row, in px.
    #[inline]
    pub fn pixel(&self, a: f64, b: f64) -> (f64, f64) {
        let (a, b) = self.distortion.apply(a, b);
        (
            self.focal_length_x_px * a + self.principal_point_x_px,
            self.focal_length_y_px * b + self.principal_point_y_px,
        )
    }

    /// The ray (a, b, 1) that is seen at column `x_px` and row `y_px`; `None` where the distortion cannot be
    /// undone.
    pub fn ray(&self, x_px: f64, y_px: f64) -> Option<(f64, f64)> {
        self.distortion.remove(
            (x_px - self.principal_point_x_px) / self.focal_length_x_px,
            (y_px - self.principal_point_y_px) / self.focal_length_y_px,
        )
    }

    /// Where the ray (a, b, 1) is seen, with derivatives.
    pub fn project(&self, a: f64, b: f64) -> Projection {
        let seen = self.distortion.distorted(a, b);
        let row = |focal: f64, place: f64, by_ray: [f64; 2], by_terms: [f64; 5], axis: usize| {
            let mut by_lens = [0.0; Self::PARAMETERS];
            by_lens[axis] = place;
            by_lens[2 + axis] = 1.0;
            by_lens[4..].iter_mut().zip(by_terms).for_each(|(out, term)| *out = focal * term);
            (by_ray.map(|derivative| focal * derivative), by_lens)
        };
        let (fx, fy) = (self.focal_length_x_px, self.focal_length_y_px);
        let (x_by_ray, x_by_lens) = row(fx, seen.a, seen.by_ray[0], seen.by_terms[0], 0);
        let (y_by_ray, y_by_lens) = row(fy, seen.b, seen.by_ray[1], seen.by_terms[1], 1);
        Projection {
            x_px: fx * seen.a + self.principal_point_x_px,
            y_px: fy * seen.b + self.principal_point_y_px,
            by_ray: [x_by_ray, y_by_ray],
            by_lens: [x_by_lens, y_by_lens],
        }
    }

    /// All parameters: fx, fy, cx, cy, k1, k2, p1, p2, k3.
    pub fn to_array(&self) -> [f64; Self::PARAMETERS] {
        let Distortion { k1, k2, p1, p2, k3 } = self.distortion;
        let (fx, fy) = (self.focal_length_x_px, self.focal_length_y_px);
        [fx, fy, self.principal_point_x_px, self.principal_point_y_px, k1, k2, p1, p2, k3]
    }

    /// The lens with these parameters, in the order of [`Self::to_array`].
    pub fn from_array([fx, fy, cx, cy, k1, k2, p1, p2, k3]: [f64; Self::PARAMETERS]) -> Self {
        Self {
            focal_length_x_px: fx,
            focal_length_y_px: fy,
            principal_point_x_px: cx,
            principal_point_y_px: cy,
            distortion: Distortion { k1, k2, p1, p2, k3 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_agree_with_differences() {
        let parameters = [800.0, 790.0, 321.0, 243.0, -0.2, 0.1, 0.003, -0.002, 0.05];
        let (a, b) = (0.21, -0.33);
        let projection = Lens::from_array(parameters).project(a, b);
        assert_eq!((projection.x_px, projection.y_px), Lens::from_array(parameters).pixel(a, b));
        for index in 0..Lens::PARAMETERS {
            let step = 1e-6 * parameters[index].abs();
            let at = |sign: f64| {
                let mut moved = parameters;
                moved[index] += sign * step;
                Lens::from_array(moved).pixel(a, b)
            };
            let ((x1, y1), (x0, y0)) = (at(1.0), at(-1.0));
            let close = |found: f64, expected: f64| (found - expected).abs() < 1e-6 * (1.0 + expected.abs());
            assert!(close(projection.by_lens[0][index], (x1 - x0) / (2.0 * step)), "{index}");
            assert!(close(projection.by_lens[1][index], (y1 - y0) / (2.0 * step)), "{index}");
        }
        let lens = Lens::from_array(parameters);
        let step = 1e-7;
        for (axis, (da, db)) in [(step, 0.0), (0.0, step)].into_iter().enumerate() {
            let ((x1, y1), (x0, y0)) = (lens.pixel(a + da, b + db), lens.pixel(a - da, b - db));
            assert!((projection.by_ray[0][axis] - (x1 - x0) / (2.0 * step)).abs() < 1e-4);
            assert!((projection.by_ray[1][axis] - (y1 - y0) / (2.0 * step)).abs() < 1e-4);
        }
    }
}
