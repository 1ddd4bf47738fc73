//! The simulated lens and pixel grid, and how the camera is mounted.

use serde::{Deserialize, Serialize};

use super::distortion::Distortion;
use super::error::{SimulatorError, require};
use super::pinhole::Pinhole;
use super::sight::{Sight, Turn};

/// The camera may be panned by less than this, in rad: more is a mistake, and the scene would be seen from
/// the side.
const MOST_PAN_RAD: f64 = 0.5;

/// A camera: a pinhole x = f X / Z + c_x, y = f Y / Z + c_y with distortion, roll and pan against the stage
/// axis, point spread and vignetting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Optics {
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
    /// Standard deviation of the Gaussian point spread, in px; 0 for none. The pixel's own area comes on top.
    pub point_spread_sigma_px: f64,
    /// Light lost in the corner farthest from the principal point, 0 to less than 1; the loss follows cos^4.
    pub vignetting: f64,
    /// How far the camera is rolled about its optical axis: r' = Ry(pan) Rz(roll) r takes a ray r of the
    /// camera into the rectified frame, in which the scene moves exactly along x.
    #[serde(default)]
    pub roll_rad: f64,
    /// Pan of the camera, in rad; between -0.5 and 0.5.
    #[serde(default)]
    pub pan_rad: f64,
    /// The distortion of the lens.
    #[serde(default)]
    pub distortion: Distortion,
}

impl Optics {
    /// A square image with the principal point in its middle, a point spread of 0.5 px, and no fault.
    pub fn square(side_px: usize, focal_length_px: f64) -> Self {
        let middle = 0.5 * (side_px as f64 - 1.0);
        Self {
            rows: side_px,
            columns: side_px,
            focal_length_px,
            principal_point_x_px: middle,
            principal_point_y_px: middle,
            point_spread_sigma_px: 0.5,
            vignetting: 0.0,
            roll_rad: 0.0,
            pan_rad: 0.0,
            distortion: Distortion::default(),
        }
    }

    pub(super) fn check(&self) -> Result<(), SimulatorError> {
        let Self { point_spread_sigma_px, vignetting, roll_rad, pan_rad, distortion, .. } = *self;
        let fits = (0.0..=10.0).contains(&point_spread_sigma_px);
        require(fits, "point spread in px", point_spread_sigma_px, "from 0 to 10")?;
        require((0.0..1.0).contains(&vignetting), "vignetting", vignetting, "from 0 to less than 1")?;
        require(roll_rad.abs() <= std::f64::consts::PI, "roll in rad", roll_rad, "from -pi to pi")?;
        require(pan_rad.abs() < MOST_PAN_RAD, "pan in rad", pan_rad, "between -0.5 and 0.5")?;
        let sight = self.sight();
        for (x, y) in self.border() {
            let raw = sight.raw_ray(x, y);
            let is_unfolded = !raw.0.is_nan() && distortion.unfolded_up_to(raw);
            let expected = "with the others such that the image does not fold";
            require(is_unfolded, "distortion k1", distortion.k1, expected)?;
            let looks_ahead = !sight.ray(x, y).0.is_nan();
            require(looks_ahead, "pan in rad", pan_rad, "such that every pixel looks ahead")?;
        }
        Ok(())
    }

    /// The camera's geometry, made ready for many pixels.
    pub(super) fn sight(&self) -> Sight {
        let is_turned = self.roll_rad != 0.0 || self.pan_rad != 0.0;
        Sight {
            focal_length_px: self.focal_length_px,
            principal_point_px: (self.principal_point_x_px, self.principal_point_y_px),
            distortion: (!self.distortion.is_none()).then_some(self.distortion),
            turn: is_turned.then(|| Turn::new(self.roll_rad, self.pan_rad)),
        }
    }

    /// Direction (X / Z, Y / Z), in the rectified frame, of the ray through image point (x, y), to 1e-13. NaN
    /// for points far outside of the image where the lens shows nothing.
    pub fn ray(&self, x: f64, y: f64) -> (f64, f64) {
        self.sight().ray(x, y)
    }

    /// Image point of the ray (X / Z, Y / Z) of the rectified frame; the inverse of [`ray`](Self::ray). It
    /// may lie outside of the image. NaN for rays that do not come from ahead of the camera.
    pub fn pixel(&self, ray: (f64, f64)) -> (f64, f64) {
        self.sight().pixel(ray)
    }

    /// The ideal pinhole with this focal length, principal point and image: the simplest rectified view.
    pub fn pinhole(&self) -> Pinhole {
        Pinhole {
            rows: self.rows,
            columns: self.columns,
            focal_length_px: self.focal_length_px,
            principal_point_x_px: self.principal_point_x_px,
            principal_point_y_px: self.principal_point_y_px,
        }
    }

    /// Whether the camera is its own pinhole: the scene moves along rows, and the lens has no distortion.
    pub fn is_rectified(&self) -> bool {
        self.roll_rad == 0.0 && self.pan_rad == 0.0 && self.distortion.is_none()
    }

    /// Largest |X / Z| and |Y / Z|, in the rectified frame, of any ray that a pixel can receive, the point
    /// spread included.
    pub(super) fn steepest_ray(&self) -> (f64, f64) {
        if self.is_rectified() {
            let reach = self.reach_px();
            let steepest = |size: usize, middle: f64| {
                (middle + reach).max(size as f64 - 1.0 + reach - middle) / self.focal_length_px
            };
            return (
                steepest(self.columns, self.principal_point_x_px),
                steepest(self.rows, self.principal_point_y_px),
            );
        }
        // An image that does not fold has its steepest rays on its border.
        let sight = self.sight();
        self.border().map(|(x, y)| sight.ray(x, y)).fold((0.0, 0.0), |(steepest_a, steepest_b), (a, b)| {
            (a.abs().max(steepest_a), b.abs().max(steepest_b))
        })
    }

    /// How far outside of a pixel's middle light reaches it from.
    fn reach_px(&self) -> f64 {
        1.0 + 5.0 * self.point_spread_sigma_px
    }

    /// Image points around all that a pixel can receive, at most a pixel apart.
    fn border(&self) -> impl Iterator<Item = (f64, f64)> {
        let reach = self.reach_px();
        let (right, bottom) = (self.columns as f64 - 1.0 + reach, self.rows as f64 - 1.0 + reach);
        let along = move |end: f64| {
            let steps = (end + reach).ceil();
            (0..=steps as usize).map(move |step| (step as f64 / steps) * (end + reach) - reach)
        };
        let level = along(right).flat_map(move |x| [(x, -reach), (x, bottom)]);
        level.chain(along(bottom).flat_map(move |y| [(-reach, y), (right, y)]))
    }

    /// Share of the light that pixel (x, y) receives: 1 / (1 + k r^2)^2, which is cos^4 of the ray's angle to
    /// the axis for the k that loses `vignetting` in the farthest corner.
    pub fn transmission(&self, x: f64, y: f64) -> f64 {
        self.transmissions()(x, y)
    }

    /// [`transmission`](Self::transmission), made ready for many pixels.
    pub(super) fn transmissions(&self) -> impl Fn(f64, f64) -> f64 + Sync {
        let middle = (self.principal_point_x_px, self.principal_point_y_px);
        let square = move |x: f64, y: f64| (x - middle.0).powi(2) + (y - middle.1).powi(2);
        let (right, bottom) = (self.columns as f64 - 1.0, self.rows as f64 - 1.0);
        let corner = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)]
            .iter()
            .fold(f64::MIN_POSITIVE, |farthest, &(x, y)| farthest.max(square(x, y)));
        let k = ((1.0 - self.vignetting).powf(-0.5) - 1.0) / corner;
        move |x, y| (1.0 + k * square(x, y)).powi(-2)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_corner_loses_what_is_stated_and_the_axis_nothing() {
        let optics = Optics { vignetting: 0.15, ..Optics::square(101, 300.0) };
        assert!((optics.transmission(50.0, 50.0) - 1.0).abs() < 1e-12);
        assert!((optics.transmission(0.0, 100.0) - 0.85).abs() < 1e-12);
        // cos^4 falls with r^2 near the axis: a quarter of the radius loses about a sixteenth of the loss.
        let quarter = 1.0 - optics.transmission(50.0 + 12.5, 50.0 + 12.5);
        assert!((quarter / 0.15 - 1.0 / 16.0).abs() < 0.01, "{quarter}");
    }

    #[test]
    fn roll_and_pan_turn_rays_as_their_definition_says() {
        // Rz(roll) takes (1, 0, .) to (cos, sin, .): what lies to the right of a rolled camera lies to the
        // right and below.
        let rolled = Optics { roll_rad: 0.01, ..Optics::square(101, 100.0) };
        let (a, b) = rolled.ray(100.0, 50.0);
        assert!((a - 0.5 * 0.01_f64.cos()).abs() < 1e-15 && (b - 0.5 * 0.01_f64.sin()).abs() < 1e-15);
        // Ry(pan) takes the axis (0, 0, 1) to (sin, 0, cos).
        let panned = Optics { pan_rad: 0.01, ..Optics::square(101, 100.0) };
        let (a, b) = panned.ray(50.0, 50.0);
        assert!((a - 0.01_f64.tan()).abs() < 1e-15 && b == 0.0);
    }

    #[test]
    fn impossible_mountings_and_lenses_are_refused() {
        let sound = Optics::square(101, 100.0);
        assert_eq!(sound.check(), Ok(()));
        let refused = |optics: Optics| matches!(optics.check(), Err(SimulatorError::BadNumber { .. }));
        assert!(refused(Optics { pan_rad: 0.6, ..sound.clone() }));
        assert!(refused(Optics { roll_rad: f64::NAN, ..sound.clone() }));
        // The corner lies at r = 0.75; r (1 - r^2) does not reach it.
        let folding = Distortion { k1: -1.0, ..Distortion::default() };
        assert!(refused(Optics { distortion: folding, ..sound }));
    }

    #[test]
    fn the_steepest_rays_bound_those_of_all_pixels() {
        let distortion = Distortion { k1: -0.1, k2: 0.05, p1: 0.003, p2: -0.002, k3: 0.0 };
        let optics = Optics { roll_rad: 0.3, pan_rad: -0.2, distortion, ..Optics::square(61, 80.0) };
        let (steepest_a, steepest_b) = optics.steepest_ray();
        for y in -3..64 {
            for x in -3..64 {
                let (a, b) = optics.ray(f64::from(x), f64::from(y));
                assert!(a.abs() <= steepest_a && b.abs() <= steepest_b, "({x}, {y})");
            }
        }
        // As if nothing were there, for what nothing turns.
        let straight = Optics { roll_rad: 1e-300, ..Optics::square(61, 80.0) };
        let plain = Optics::square(61, 80.0).steepest_ray();
        assert!((straight.steepest_ray().0 - plain.0).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn ray_and_pixel_are_inverse(
            (x, y) in (-5.0..645.0, -5.0..485.0),
            (roll_rad, pan_rad) in (-3.0..3.0, -0.3..0.3),
            (k1, k2, k3) in (-0.1..0.1, -0.05..0.05, -0.02..0.02),
            (p1, p2) in (-0.005..0.005, -0.005..0.005),
        ) {
            let optics = Optics {
                rows: 480,
                columns: 640,
                principal_point_x_px: 310.0,
                principal_point_y_px: 251.0,
                roll_rad,
                pan_rad,
                distortion: Distortion { k1, k2, p1, p2, k3 },
                ..Optics::square(640, 900.0)
            };
            prop_assert_eq!(optics.check(), Ok(()));
            let (back_x, back_y) = optics.pixel(optics.ray(x, y));
            prop_assert!((back_x - x).abs() < 1e-9 && (back_y - y).abs() < 1e-9, "{} {}", back_x, back_y);
        }
    }
}
