//! The plane through the observations of a disc.
//!
//! ```text
//! v_j = a + p x_j + q y_j + noise      p, q ~ N(0, 0.1^2), a flat
//! A = X' W X + prior      A (q, p, a)' = X' W v      A = L L'
//! ```
//!
//! Sums of weights that L^-1 has whitened make the parameters of everything that is fitted besides
//! the plane independent of it.

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, f32x16};

/// Prior standard deviation of slants, in px of disparity per px.
const SLANT: f32 = 0.1;
/// Less than this share of the weight is lost in rounding.
const LEAST_SHARE: f32 = 1e-5;

/// Sums over a disc: weights times 1, x, y, xx, xy, yy, and moments times 1, x, y. Moments are
/// weights times observed disparities.
#[derive(Clone, Copy)]
pub(super) struct Normal<S: Simd>([f32x16<S>; 9]);

impl<S: Simd> Normal<S> {
    #[inline(always)]
    pub(super) fn prior(simd: S) -> Self {
        let mut sums = [f32x16::splat(simd, 0.0); 9];
        let prior = f32x16::splat(simd, 1.0 / (SLANT * SLANT));
        (sums[3], sums[5]) = (prior, prior);
        Self(sums)
    }

    #[inline(always)]
    pub(super) fn add(&mut self, (x, y): (f32, f32), weight: f32x16<S>, moment: f32x16<S>) {
        let [w, wx, wy, wxx, wxy, wyy, m, mx, my] = &mut self.0;
        *w += weight;
        *wx = weight.mul_add(x, *wx);
        *wy = weight.mul_add(y, *wy);
        *wxx = weight.mul_add(x * x, *wxx);
        *wxy = weight.mul_add(x * y, *wxy);
        *wyy = weight.mul_add(y * y, *wyy);
        *m += moment;
        *mx = moment.mul_add(x, *mx);
        *my = moment.mul_add(y, *my);
    }

    /// The likeliest plane.
    #[inline(always)]
    pub(super) fn solve(&self, simd: S) -> Plane<S> {
        let one = f32x16::splat(simd, 1.0);
        let [w, wx, wy, wxx, wxy, wyy, m, mx, my] = self.0;
        let over_y = one / wyy.sqrt();
        let x_of_y = wxy * over_y;
        let over_x = one / (wxx - x_of_y * x_of_y).sqrt();
        let one_of_y = wy * over_y;
        let one_of_x = (wx - x_of_y * one_of_y) * over_x;
        let rest = w - one_of_y * one_of_y - one_of_x * one_of_x;
        let known = rest.simd_gt(w * LEAST_SHARE);
        let over_one = one / known.select(rest, one).sqrt();
        let along_y = my * over_y;
        let along_x = (mx - x_of_y * along_y) * over_x;
        let along_one = (m - one_of_y * along_y - one_of_x * along_x) * over_one;
        let disparity = along_one * over_one;
        let slant_x = (along_x - one_of_x * disparity) * over_x;
        let slant_y = (along_y - x_of_y * slant_x - one_of_y * disparity) * over_y;
        Plane {
            over: [over_y, over_x, over_one],
            x_of_y,
            one_of: [one_of_y, one_of_x],
            along: [along_y, along_x, along_one],
            disparity,
            slants: [slant_x, slant_y],
            weight: w,
            known: known.select(one, f32x16::splat(simd, 0.0)),
        }
    }
}

/// A plane, and what makes the parameters of others independent of it.
#[derive(Clone, Copy)]
pub(super) struct Plane<S: Simd> {
    over: [f32x16<S>; 3],
    x_of_y: f32x16<S>,
    one_of: [f32x16<S>; 2],
    along: [f32x16<S>; 3],
    /// In the middle of the disc.
    disparity: f32x16<S>,
    /// Along columns and rows.
    pub(super) slants: [f32x16<S>; 2],
    /// Sum of weights.
    pub(super) weight: f32x16<S>,
    /// 1 where the observations determine it, 0 elsewhere.
    pub(super) known: f32x16<S>,
}

impl<S: Simd> Plane<S> {
    /// L^-1 times sums of weights times 1, x, y.
    #[inline(always)]
    pub(super) fn whitened(&self, [w, wx, wy]: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
        let first = wy * self.over[0];
        let second = (wx - self.x_of_y * first) * self.over[1];
        let third = (w - self.one_of[0] * first - self.one_of[1] * second) * self.over[2];
        [first, second, third]
    }

    /// The part of a sum of moments that the plane explains, by whitened sums of weights.
    #[inline(always)]
    pub(super) fn explained(&self, [first, second, third]: [f32x16<S>; 3]) -> f32x16<S> {
        first.mul_add(self.along[0], second.mul_add(self.along[1], third * self.along[2]))
    }

    /// The whitened place of a point.
    #[inline(always)]
    pub(super) fn place(&self, simd: S, (x, y): (f32, f32)) -> [f32x16<S>; 3] {
        self.whitened([1.0, x, y].map(|value| f32x16::splat(simd, value)))
    }

    /// The part of the sum of squared observations that the plane explains.
    #[inline(always)]
    pub(super) fn explained_squares(&self) -> f32x16<S> {
        let [first, second, third] = self.along;
        first.mul_add(first, second.mul_add(second, third * third))
    }

    /// Disparity at a point.
    #[inline(always)]
    pub(super) fn at(&self, (x, y): (f32, f32)) -> f32x16<S> {
        self.slants[0].mul_add(x, self.slants[1].mul_add(y, self.disparity))
    }
}
