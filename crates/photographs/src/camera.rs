//! From directions to pixels, and back.

use nalgebra::Vector3;

/// A camera with radial distortion; its principal point is the middle of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Rows of the picture.
    pub rows: usize,
    /// Columns of the picture.
    pub columns: usize,
    /// Focal length, in px.
    pub focal_length_px: f64,
    /// Distortion: a point at r of the ideal image plane (in units of the focal length) is seen at
    /// r (1 + k1 r^2).
    pub k1: f64,
}

impl Camera {
    /// The principal point, in px.
    pub fn centre(&self) -> (f64, f64) {
        (0.5 * (self.columns as f64 - 1.0), 0.5 * (self.rows as f64 - 1.0))
    }

    /// The pixel at which the direction `y`, in the camera's own coordinates, is seen.
    pub fn pixel(&self, y: &Vector3<f64>) -> (f64, f64) {
        let (u, v) = (y.x / y.z, y.y / y.z);
        let scale = self.focal_length_px * (1.0 + self.k1 * (u * u + v * v));
        let centre = self.centre();
        (centre.0 + scale * u, centre.1 + scale * v)
    }

    /// The direction (u, v, 1) that a pixel sees.
    pub fn direction(&self, x: f64, y: f64) -> Vector3<f64> {
        let centre = self.centre();
        let (u, v) = ((x - centre.0) / self.focal_length_px, (y - centre.1) / self.focal_length_px);
        let scale = self.undistorted(u.hypot(v));
        Vector3::new(u * scale, v * scale, 1.0)
    }

    /// The factor from the distorted radius to the ideal one, by Newton's method.
    fn undistorted(&self, distorted: f64) -> f64 {
        if self.k1 == 0.0 || distorted == 0.0 {
            return 1.0;
        }
        let mut ideal = distorted;
        for _ in 0..20 {
            let squared = self.k1 * ideal * ideal;
            let gradient = 1.0 + 3.0 * squared;
            assert!(gradient > 0.0, "k1 = {} folds the picture", self.k1);
            let step = (ideal * (1.0 + squared) - distorted) / gradient;
            ideal -= step;
            if step.abs() < 1e-14 {
                break;
            }
        }
        ideal / distorted
    }
}
