//! From pixel to ray and back: a camera's geometry, made ready for many pixels.

use super::distortion::Distortion;
use super::turn::Turn;

/// The geometry of a lens and its mounting. Absent distortion and turns cost no time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    focal_length_px: f64,
    principal_point_px: (f64, f64),
    distortion: Option<Distortion>,
    turn: Option<Turn>,
}

impl Sight {
    /// The geometry of a camera with this focal length and principal point (column, row), turned by this roll
    /// and pan.
    pub(super) fn new(
        focal_length_px: f64,
        principal_point_px: (f64, f64),
        distortion: Distortion,
        (roll_rad, pan_rad): (f64, f64),
    ) -> Self {
        let turned = roll_rad != 0.0 || pan_rad != 0.0;
        Self {
            focal_length_px,
            principal_point_px,
            distortion: (!distortion.is_none()).then_some(distortion),
            turn: turned.then(|| Turn::new(roll_rad, pan_rad)),
        }
    }

    /// The undistorted ray of an image point in the camera's own frame; NaN where the lens shows nothing.
    #[inline]
    pub(super) fn raw_ray(&self, x: f64, y: f64) -> (f64, f64) {
        let f = self.focal_length_px;
        let seen = ((x - self.principal_point_px.0) / f, (y - self.principal_point_px.1) / f);
        match &self.distortion {
            None => seen,
            Some(distortion) => distortion.undistort(seen).unwrap_or((f64::NAN, f64::NAN)),
        }
    }

    /// The same in the rectified frame.
    #[inline]
    pub(super) fn ray(&self, x: f64, y: f64) -> (f64, f64) {
        let raw = self.raw_ray(x, y);
        self.turn.map_or(raw, |turn| turn.rectified(raw))
    }

    /// The image point of an undistorted ray of the camera's own frame.
    pub(super) fn raw_pixel(&self, raw: (f64, f64)) -> (f64, f64) {
        let seen = self.distortion.map_or(raw, |distortion| distortion.distort(raw));
        let f = self.focal_length_px;
        (f * seen.0 + self.principal_point_px.0, f * seen.1 + self.principal_point_px.1)
    }

    /// The image point of a ray of the rectified frame.
    pub(super) fn pixel(&self, ray: (f64, f64)) -> (f64, f64) {
        self.raw_pixel(self.turn.map_or(ray, |turn| turn.raw(ray)))
    }
}
