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
use super::edge_shapes::AtInner;

/// When an edge is more likely than the reference by this power of two, the reference becomes the
/// likeliest edge. Sums of such weights stay in the range of single precision.
const FARTHEST: f32 = 40.0;

/// An edge that has been fitted: logarithm of its weight to the base 2, alpha, 1 / S, the whitened
/// sums of its shape, and the part of the sum of squared observations that it explains.
pub(super) type Fitted<S> = [f32x16<S>; 7];

/// Sums over the edges so far, relative to a weight whose logarithm to the base 2 is the reference;
/// that of no edge is 0.
pub(super) struct Average<S: Simd> {
    reference: f32x16<S>,
    weight: f32x16<S>,
    /// The weight of the edges before those of the last direction.
    before: f32x16<S>,
    shifts: [f32x16<S>; 4],
    squares: [f32x16<S>; 4],
    by_place: [f32x16<S>; 4],
    explained: f32x16<S>,
    /// The weight of each family, if these are counted.
    families: [f32x16<S>; 3],
}

/// A weight, and the reference that it is counted from.
#[derive(Clone, Copy)]
pub(super) struct Weight<S: Simd> {
    weight: f32x16<S>,
    reference: f32x16<S>,
}

impl<S: Simd> Weight<S> {
    #[inline(always)]
    pub(super) fn none(simd: S) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        Self { weight: zero, reference: zero }
    }
}

/// What edges change at an inner pixel.
#[derive(Clone, Copy)]
pub(super) struct Change<S: Simd> {
    /// Of the plane's disparity, in px.
    pub(super) shift: f32x16<S>,
    /// Added to the variance of the plane's disparity, in px^2.
    pub(super) variance: f32x16<S>,
    /// Variance by edges that lie between the places that are tried.
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
    #[inline(always)]
    pub(super) fn of_no_edge(simd: S) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        Self {
            reference: zero,
            weight: zero,
            before: zero,
            shifts: [zero; 4],
            squares: [zero; 4],
            by_place: [zero; 4],
            explained: zero,
            families: [zero; 3],
        }
    }

    /// The weight of the edges that were taken since this was called last.
    #[inline(always)]
    pub(super) fn weight_of_direction(&mut self) -> Weight<S> {
        let weight = self.weight - self.before;
        self.before = self.weight;
        Weight { weight, reference: self.reference }
    }

    /// Whether a weight is more than this share of all, edges in so many directions and none, in any
    /// of the discs.
    #[inline(always)]
    pub(super) fn has(
        &self,
        simd: S,
        Weight { weight, reference }: Weight<S>,
        share: f32,
        directions: usize,
    ) -> bool {
        let whole = self.weight + power_of_two(simd, -self.reference) * directions as f32;
        (weight * power_of_two(simd, reference - self.reference)).simd_gt(whole * share).any_true()
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
        let mut likeliest = self.reference;
        for [logarithm, ..] in fitted {
            likeliest = likeliest.max(*logarithm);
        }
        if (likeliest - self.reference).simd_gt(FARTHEST).any_true() {
            self.count_from(simd, likeliest);
        }
        for (&[logarithm, alpha, over, a, b, c, explained], at_inner) in fitted.iter().zip(at_inner) {
            let weight = power_of_two(simd, logarithm - self.reference);
            self.weight += weight;
            self.explained = weight.mul_add(explained, self.explained);
            let first = weight * alpha;
            let place = first * alpha;
            let second = weight.mul_add(over, place);
            if COUNTS {
                self.families[at_inner.family] += weight;
            }
            for (index, [y, x, one]) in places.iter().enumerate() {
                let plane = a.mul_add(*y, b.mul_add(*x, c * *one));
                let follows = f32x16::splat(simd, at_inner.shape[index]) - plane;
                self.shifts[index] = first.mul_add(follows, self.shifts[index]);
                self.squares[index] = (second * follows).mul_add(follows, self.squares[index]);
                self.by_place[index] = place.mul_add(at_inner.variance[index], self.by_place[index]);
            }
        }
    }

    #[inline(always)]
    fn count_from(&mut self, simd: S, reference: f32x16<S>) {
        let fade = power_of_two(simd, self.reference - reference);
        self.reference = reference;
        self.weight *= fade;
        self.before *= fade;
        self.explained *= fade;
        for sums in [&mut self.shifts, &mut self.squares, &mut self.by_place] {
            sums.iter_mut().for_each(|sum| *sum *= fade);
        }
        self.families.iter_mut().for_each(|sum| *sum *= fade);
    }

    /// The average of none, and of all that were taken, in so many directions: each direction is as
    /// likely as any other.
    #[inline(always)]
    pub(super) fn averaged(&self, simd: S, directions: usize) -> Averaged<S> {
        let one = f32x16::splat(simd, 1.0);
        let none = power_of_two(simd, -self.reference) * directions as f32;
        let over = one / (self.weight + none);
        let mut averaged = Averaged::none(simd);
        for (index, change) in averaged.changes.iter_mut().enumerate() {
            change.shift = self.shifts[index] * over;
            let variance = self.squares[index] * over - change.shift * change.shift;
            change.variance = variance.max(f32x16::splat(simd, 0.0));
            change.by_place = self.by_place[index] * over;
        }
        averaged.explained = self.explained * over;
        averaged.none = none * over;
        averaged.families = self.families.map(|family| family * over);
        averaged
    }
}
