//! The distortion of the simulated lens. Written for the simulator alone, so that what is tested against it
//! shares no code with it.

use serde::{Deserialize, Serialize};

/// Newton's iteration ends with a step shorter than this, in units of X / Z. The error left is the square of
/// it times the curvature of the lens, at most a few times 1e-14.
const SHORT: f64 = 1e-7;
/// Most steps: Newton doubles the digits with each, so a search that has not ended has no solution.
const STEPS: usize = 40;
/// An area may shrink to this share of what a pinhole would make of it. Lenses stay above a half; where it
/// reaches zero the image folds over itself.
const LEAST_AREA: f64 = 0.1;
/// Number of places between the axis and a ray at which the area is checked.
const ALONG: usize = 32;

/// Radial and tangential distortion after Brown and Conrady, with the names and the order of OpenCV.
///
/// For a ray (a, b) = (X / Z, Y / Z) and r2 = a^2 + b^2 the image has
/// a' = a (1 + k1 r2 + k2 r2^2 + k3 r2^3) + 2 p1 a b + p2 (r2 + 2 a^2),
/// b' = b (1 + k1 r2 + k2 r2^2 + k3 r2^3) + p1 (r2 + 2 b^2) + 2 p2 a b. All zero: none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Distortion {
    /// Radial, of r2; negative for a barrel.
    pub k1: f64,
    /// Radial, of r2^2.
    pub k2: f64,
    /// Tangential, along y.
    pub p1: f64,
    /// Tangential, along x.
    pub p2: f64,
    /// Radial, of r2^3.
    pub k3: f64,
}

impl Distortion {
    /// Whether the lens has no distortion.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Where the lens puts the undistorted ray (a, b).
    pub(super) fn distort(&self, (a, b): (f64, f64)) -> (f64, f64) {
        let Self { p1, p2, .. } = *self;
        let r2 = a * a + b * b;
        let radial = self.radial(r2);
        (
            a * radial + 2.0 * p1 * a * b + p2 * (r2 + 2.0 * a * a),
            b * radial + p1 * (r2 + 2.0 * b * b) + 2.0 * p2 * a * b,
        )
    }

    /// The undistorted ray that the lens puts at (a, b): Newton's iteration from there. `None` where it finds
    /// none.
    pub(super) fn undistort(&self, (a, b): (f64, f64)) -> Option<(f64, f64)> {
        let mut ray = (a, b);
        for _ in 0..STEPS {
            let distorted = self.distort(ray);
            let (along, across, down) = self.slopes(ray);
            let area = along * down - across * across;
            let (miss_a, miss_b) = (distorted.0 - a, distorted.1 - b);
            let step = ((down * miss_a - across * miss_b) / area, (along * miss_b - across * miss_a) / area);
            ray = (ray.0 - step.0, ray.1 - step.1);
            let length = step.0.abs().max(step.1.abs());
            if length < SHORT {
                return Some(ray);
            }
            if !length.is_finite() {
                return None;
            }
        }
        None
    }

    /// Whether the image does not fold over itself between the axis and the ray (a, b).
    pub(super) fn unfolded_up_to(&self, (a, b): (f64, f64)) -> bool {
        (0..=ALONG).all(|step| {
            let share = step as f64 / ALONG as f64;
            let (along, across, down) = self.slopes((share * a, share * b));
            along * down - across * across > LEAST_AREA
        })
    }

    fn radial(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
    }

    /// da'/da, da'/db = db'/da, db'/db.
    fn slopes(&self, (a, b): (f64, f64)) -> (f64, f64, f64) {
        let Self { k1, k2, p1, p2, k3 } = *self;
        let r2 = a * a + b * b;
        let radial = self.radial(r2);
        let growth = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        (
            radial + growth * a * a + 2.0 * p1 * b + 6.0 * p2 * a,
            growth * a * b + 2.0 * p1 * a + 2.0 * p2 * b,
            radial + growth * b * b + 6.0 * p1 * b + 2.0 * p2 * a,
        )
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn distorts_by_the_amounts_computed_by_hand() {
        // r2 = 0.09 + 0.16 = 0.25; radial 1 - 0.02 * 0.25 + 0.1 * 0.0625 = 1.00125.
        let radial = Distortion { k1: -0.02, k2: 0.1, ..Distortion::default() };
        let (a, b) = radial.distort((0.3, 0.4));
        assert!((a - 0.300_375).abs() < 1e-15 && (b - 0.4005).abs() < 1e-15, "{a} {b}");
        // 2 * 0.01 * 0.12 = 0.0024; 0.01 * (0.25 + 0.32) = 0.0057.
        let (a, b) = Distortion { p1: 0.01, ..Distortion::default() }.distort((0.3, 0.4));
        assert!((a - 0.3024).abs() < 1e-15 && (b - 0.4057).abs() < 1e-15, "{a} {b}");
        // 0.01 * (0.25 + 0.18) = 0.0043.
        let (a, b) = Distortion { p2: 0.01, ..Distortion::default() }.distort((0.3, 0.4));
        assert!((a - 0.3043).abs() < 1e-15 && (b - 0.4024).abs() < 1e-15, "{a} {b}");
        // 64 * 0.25^3 = 1.
        let (a, _) = Distortion { k3: 64.0, ..Distortion::default() }.distort((0.3, 0.4));
        assert!((a - 0.6).abs() < 1e-15, "{a}");
    }

    #[test]
    fn a_lens_that_folds_the_image_is_seen() {
        // r (1 - r^2) is largest at r = 0.577.
        let folding = Distortion { k1: -1.0, ..Distortion::default() };
        assert!(folding.unfolded_up_to((0.3, 0.2)));
        assert!(!folding.unfolded_up_to((0.5, 0.3)));
        // What Newton finds for a place beyond the largest, if anything, lies on the other side of the fold.
        let found = folding.undistort((0.5, 0.3));
        assert!(found.is_none_or(|ray| !folding.unfolded_up_to(ray)), "{found:?}");
    }

    proptest! {
        #[test]
        fn straightened_rays_bend_to_where_they_came_from(
            (a, b) in (-0.5..0.5, -0.5..0.5),
            (k1, k2, k3) in (-0.3..0.3, -0.1..0.1, -0.05..0.05),
            (p1, p2) in (-0.01..0.01, -0.01..0.01),
        ) {
            let lens = Distortion { k1, k2, p1, p2, k3 };
            let distorted = lens.distort((a, b));
            let ray = lens.undistort(distorted).unwrap();
            prop_assert!((ray.0 - a).abs() < 1e-12 && (ray.1 - b).abs() < 1e-12, "{ray:?}");
        }
    }
}
