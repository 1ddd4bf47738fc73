//! Radial and tangential distortion.

use serde::{Deserialize, Serialize};

/// Distortion after Brown (1966) and Conrady (1919), in the terms and the order of OpenCV.
///
/// With r2 = a^2 + b^2 the ray (a, b, 1) is seen at a (1 + k1 r2 + k2 r2^2 + k3 r2^3) + 2 p1 a b + p2 (r2 + 2
/// a^2), and likewise for b with p1 and p2 exchanged.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Distortion {
    /// Radial, of second order.
    pub k1: f64,
    /// Radial, of fourth order.
    pub k2: f64,
    /// Tangential: of a lens tilted about x.
    pub p1: f64,
    /// Tangential: of a lens tilted about y.
    pub p2: f64,
    /// Radial, of sixth order.
    pub k3: f64,
}

/// A distorted point with its derivatives.
pub(super) struct Distorted {
    pub(super) a: f64,
    pub(super) b: f64,
    /// Derivatives of (a, b) by the undistorted (a, b).
    pub(super) by_ray: [[f64; 2]; 2],
    /// Derivatives of (a, b) by k1, k2, p1, p2, k3.
    pub(super) by_terms: [[f64; 5]; 2],
}

impl Distortion {
    /// Where the ray (a, b, 1) is seen.
    #[inline]
    pub fn apply(&self, a: f64, b: f64) -> (f64, f64) {
        let r2 = a * a + b * b;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        (
            a * radial + 2.0 * self.p1 * a * b + self.p2 * (r2 + 2.0 * a * a),
            b * radial + self.p1 * (r2 + 2.0 * b * b) + 2.0 * self.p2 * a * b,
        )
    }

    /// The ray that is seen at (a, b), by Newton's method; `None` where the distortion cannot be undone:
    /// beyond the radius at which it folds the image back on itself.
    pub fn remove(&self, a: f64, b: f64) -> Option<(f64, f64)> {
        if *self == Self::default() {
            return Some((a, b));
        }
        let (mut u, mut v) = (a, b);
        for _ in 0..50 {
            let here = self.distorted(u, v);
            let [[aa, ab], [ba, bb]] = here.by_ray;
            let determinant = aa * bb - ab * ba;
            // Positive until the image folds.
            if determinant.is_nan() || determinant <= 0.0 {
                return None;
            }
            let (da, db) = (a - here.a, b - here.b);
            let (du, dv) = ((bb * da - ab * db) / determinant, (aa * db - ba * da) / determinant);
            (u, v) = (u + du, v + dv);
            if du.abs().max(dv.abs()) < 1e-15 * (1.0 + u.abs() + v.abs()) {
                return Some((u, v));
            }
        }
        let (x, y) = self.apply(u, v);
        ((x - a).abs().max((y - b).abs()) < 1e-12).then_some((u, v))
    }

    pub(super) fn distorted(&self, a: f64, b: f64) -> Distorted {
        let r2 = a * a + b * b;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        let by_r2 = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + 3.0 * r2 * self.k3));
        let (x, y) = self.apply(a, b);
        let mixed = a * b * by_r2 + 2.0 * self.p1 * a + 2.0 * self.p2 * b;
        Distorted {
            a: x,
            b: y,
            by_ray: [
                [radial + a * a * by_r2 + 2.0 * self.p1 * b + 6.0 * self.p2 * a, mixed],
                [mixed, radial + b * b * by_r2 + 6.0 * self.p1 * b + 2.0 * self.p2 * a],
            ],
            by_terms: [
                [a * r2, a * r2 * r2, 2.0 * a * b, r2 + 2.0 * a * a, a * r2 * r2 * r2],
                [b * r2, b * r2 * r2, r2 + 2.0 * b * b, 2.0 * a * b, b * r2 * r2 * r2],
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_was_distorted_comes_back(a in -0.3..0.3, b in -0.3..0.3, k1 in -0.4..0.4, p in -0.01..0.01) {
            let distortion = Distortion { k1, k2: 0.2, p1: p, p2: -0.7 * p, k3: -0.1 };
            let (x, y) = distortion.apply(a, b);
            let (u, v) = distortion.remove(x, y).unwrap();
            prop_assert!((u - a).abs() < 1e-12 && (v - b).abs() < 1e-12);
        }
    }

    #[test]
    fn a_fold_is_noticed() {
        // a (1 - a^2) is largest, 0.385, at a = 0.577: nothing is seen beyond.
        let distortion = Distortion { k1: -1.0, ..Distortion::default() };
        assert!(distortion.remove(0.38, 0.0).is_some());
        assert!(distortion.remove(0.39, 0.0).is_none());
    }
}
