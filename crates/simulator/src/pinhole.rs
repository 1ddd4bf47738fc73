//! The ideal camera for which truth is known.

use serde::{Deserialize, Serialize};

/// An ideal pinhole camera in the rectified frame: x = f X / Z + c_x, y = f Y / Z + c_y, and the scene moves
/// exactly along x.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pinhole {
    /// Rows of the image.
    pub rows: usize,
    /// Columns of the image.
    pub columns: usize,
    /// Focal length, in px.
    pub focal_length_px: f64,
    /// Principal point, column.
    pub principal_point_x_px: f64,
    /// Principal point, row.
    pub principal_point_y_px: f64,
}

impl Pinhole {
    /// Direction (X / Z, Y / Z) of the ray through image point (x, y).
    pub fn ray(&self, x: f64, y: f64) -> (f64, f64) {
        let f = self.focal_length_px;
        ((x - self.principal_point_x_px) / f, (y - self.principal_point_y_px) / f)
    }
}
