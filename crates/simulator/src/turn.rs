//! Roll and pan of the simulated camera against the stage axis.

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
