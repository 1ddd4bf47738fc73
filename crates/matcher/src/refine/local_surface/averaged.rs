//! The average over edges, by their posterior weights.
//!
//! ```text
//! disparity at a pixel e: plane + alpha f, f = phi(e) - e' A^-1 X' W phi, variance e' A^-1 e + f^2 / S
//! ```
//!
//! The mean over all edges and none is the posterior's (Bayesian model averaging; Hoeting and
//! others 1999). Its variance is the mean of the variances and the variance of the means, so an
//! edge whose place or existence is uncertain widens it.

use fearless_simd::{Simd, SimdBase, SimdFloat, SimdMask, f32x16};

use super::approximate::power_of_two;
use super::disc::INNER;
use super::edge_shapes::AtInner;

/// Edges that are less likely than the likeliest by this power of two change nothing, all together.
const NEGLIGIBLE: f32 = 24.0;

/// An edge that has been fitted: logarithm of its weight to the base 2, alpha, 1 / S, the whitened
/// sums of its shape, and the part of the sum of squared observations that it explains.
pub(super) type Fitted<S> = [f32x16<S>; 7];

/// Averages over edges so far, relative to the likeliest.
pub(super) struct Average<S: Simd> {
    likeliest: f32x16<S>,
    weight: f32x16<S>,
    shifts: [f32x16<S>; 4],
    squares: [f32x16<S>; 4],
    by_place: [f32x16<S>; 4],
    explained: f32x16<S>,
    /// The weight of each family, if these are counted.
    families: [f32x16<S>; 3],
}

/// What edges change at an inner pixel.
#[derive(Clone, Copy)]
pub(super) struct Change<S: Simd> {
    /// Of the plane's disparity, in px.
    pub(super) shift: f32x16<S>,
    /// Added to the variance of the plane's disparity, in px^2.
    pub(super) variance: f32x16<S>,
    /// Variance by the places of walls between those that are tried.
    pub(super) by_place: f32x16<S>,
}

/// The average over all edges and none.
pub(super) struct Averaged<S: Simd> {
    /// At each inner pixel.
    pub(super) changes: [Change<S>; 4],
    /// The part of the sum of squared observations that edges explain.
    pub(super) explained: f32x16<S>,
    /// Probability that there is no edge.
    pub(super) none: f32x16<S>,
    /// Probability that there is one of each family, if these are counted.
    pub(super) families: [f32x16<S>; 3],
}

impl<S: Simd> Averaged<S> {
    /// Without edges.
    #[inline(always)]
    pub(super) fn none(simd: S) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        Self {
            changes: [Change { shift: zero, variance: zero, by_place: zero }; 4],
            explained: zero,
            none: f32x16::splat(simd, 1.0),
            families: [zero; 3],
        }
    }
}

impl<S: Simd> Average<S> {
    /// Of none so far: a plane alone has the weight 1.
    #[inline(always)]
    pub(super) fn of_none(simd: S) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        Self {
            likeliest: zero,
            weight: f32x16::splat(simd, 1.0),
            shifts: [zero; 4],
            squares: [zero; 4],
            by_place: [zero; 4],
            explained: zero,
            families: [zero; 3],
        }
    }

    /// Takes edges. `places` are the whitened places of the inner pixels.
    #[inline(always)]
    pub(super) fn take<'a, const COUNTS: bool>(
        &mut self,
        simd: S,
        places: &[[f32x16<S>; 3]; 4],
        fitted: &[Fitted<S>],
        at_inner: impl Iterator<Item = &'a AtInner>,
    ) {
        let before = self.likeliest;
        for [logarithm, ..] in fitted {
            self.likeliest = self.likeliest.max(*logarithm);
        }
        let fade = power_of_two(simd, before - self.likeliest);
        self.weight *= fade;
        self.explained *= fade;
        for index in 0..INNER.len() {
            self.shifts[index] *= fade;
            self.squares[index] *= fade;
            self.by_place[index] *= fade;
        }
        if COUNTS {
            self.families.iter_mut().for_each(|sum| *sum *= fade);
        }
        for (&[logarithm, alpha, over, a, b, c, explained], at_inner) in fitted.iter().zip(at_inner) {
            let less = logarithm - self.likeliest;
            if !less.simd_gt(-NEGLIGIBLE).any_true() {
                continue;
            }
            let weight = power_of_two(simd, less);
            self.weight += weight;
            self.explained = weight.mul_add(explained, self.explained);
            let first = weight * alpha;
            let second = first.mul_add(alpha, weight * over);
            if COUNTS {
                self.families[at_inner.family] += weight;
            }
            for (index, [y, x, one]) in places.iter().enumerate() {
                let plane = a.mul_add(*y, b.mul_add(*x, c * *one));
                let follows = f32x16::splat(simd, at_inner.shape[index]) - plane;
                self.shifts[index] = first.mul_add(follows, self.shifts[index]);
                self.squares[index] = (second * follows).mul_add(follows, self.squares[index]);
                if at_inner.variance[index] > 0.0 {
                    let place = first * alpha;
                    self.by_place[index] = place.mul_add(at_inner.variance[index], self.by_place[index]);
                }
            }
        }
    }

    /// The average of all that were taken.
    #[inline(always)]
    pub(super) fn averaged(self, simd: S) -> Averaged<S> {
        let over = f32x16::splat(simd, 1.0) / self.weight;
        let mut averaged = Averaged::none(simd);
        for (index, change) in averaged.changes.iter_mut().enumerate() {
            change.shift = self.shifts[index] * over;
            let variance = self.squares[index] * over - change.shift * change.shift;
            change.variance = variance.max(f32x16::splat(simd, 0.0));
            change.by_place = self.by_place[index] * over;
        }
        averaged.explained = self.explained * over;
        averaged.none = power_of_two(simd, -self.likeliest) * over;
        averaged.families = self.families.map(|family| family * over);
        averaged
    }
}
