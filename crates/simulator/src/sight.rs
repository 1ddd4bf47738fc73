//! From pixel to ray and back: a camera's geometry, made ready for many pixels.

use super::distortion::Distortion;

/// The geometry of a lens and its mounting. Absent distortion and turns cost no time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    pub(super) focal_length_px: f64,
    /// Column and row.
    pub(super) principal_point_px: (f64, f64),
    pub(super) distortion: Option<Distortion>,
    pub(super) turn: Option<Turn>,
}

impl Sight {
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

/// The rotation of rays from the camera's own frame into the rectified one, in which the scene moves exactly
/// along x: r' = Ry(pan) Rz(roll) r.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    rows: [[f64; 3]; 3],
}

impl Turn {
    pub(super) fn new(roll_rad: f64, pan_rad: f64) -> Self {
        let (roll_sine, roll_cosine) = roll_rad.sin_cos();
        let (pan_sine, pan_cosine) = pan_rad.sin_cos();
        Self {
            rows: [
                [pan_cosine * roll_cosine, -pan_cosine * roll_sine, pan_sine],
                [roll_sine, roll_cosine, 0.0],
                [-pan_sine * roll_cosine, pan_sine * roll_sine, pan_cosine],
            ],
        }
    }

    /// A ray of the camera's own frame, in the rectified frame; NaN if it points to the side or back there.
    pub(super) fn rectified(&self, (a, b): (f64, f64)) -> (f64, f64) {
        let [x, y, z] = self.rows.map(|row| row[0] * a + row[1] * b + row[2]);
        forward(x, y, z)
    }

    /// A ray of the rectified frame, in the camera's own frame; NaN if it points to the side or back there.
    pub(super) fn raw(&self, (a, b): (f64, f64)) -> (f64, f64) {
        let [x, y, z] =
            [0, 1, 2].map(|axis| self.rows[0][axis] * a + self.rows[1][axis] * b + self.rows[2][axis]);
        forward(x, y, z)
    }
}

fn forward(x: f64, y: f64, z: f64) -> (f64, f64) {
    if z > 0.0 { (x / z, y / z) } else { (f64::NAN, f64::NAN) }
}
