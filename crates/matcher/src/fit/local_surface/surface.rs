//! The surface at each pixel, and how well it is known.

use fearless_simd::{Select, Simd, SimdBase, f32x16, mask32x16};
use rayon::prelude::*;

use super::observed::Observed;
use crate::fit::padded::{LANES, PAD, Padded};
use crate::one_surface::OneSurface;

/// Maps of a surface.
#[derive(Debug, Clone)]
pub(super) struct Surface {
    /// In px, from the origin.
    pub(super) disparity: Padded,
    /// Variance of the disparity if the model of the disc is right, in px^2; infinite where it is
    /// unknown.
    pub(super) variance: Padded,
    /// What is to be added to it, in px^2: by places of walls between those that are tried, and by
    /// relief that larger discs smooth away.
    pub(super) addition: Padded,
    /// Slants of the plane through the disc, in px per pixel of the map; no room where they are not
    /// needed.
    pub(super) slants: [Padded; 2],
}

/// A row of each map.
pub(super) struct SurfaceRow<'a>([&'a mut [f32]; 5]);

impl Surface {
    pub(super) fn unknown(rows: usize, columns: usize, has_slants: bool) -> Self {
        let map = |value| Padded::filled(rows, columns, value);
        let slant = || if has_slants { map(0.0) } else { Padded::given_back() };
        Self {
            disparity: map(0.0),
            variance: map(f32::INFINITY),
            addition: map(0.0),
            slants: [slant(), slant()],
        }
    }

    /// Two rows at a time; the last may be alone.
    pub(super) fn par_row_pairs(&mut self) -> impl IndexedParallelIterator<Item = Vec<SurfaceRow<'_>>> {
        let stride = self.disparity.stride;
        let [p, q] = &mut self.slants;
        let maps = [&mut self.disparity, &mut self.variance, &mut self.addition, p, q];
        let mut maps = maps.map(|map| map.values.chunks_mut(stride));
        let rows = std::iter::from_fn(move || {
            let [a, b, c, d, e] = &mut maps;
            // Maps without room have no rows.
            let [d, e] = [d, e].map(|slants| slants.next().unwrap_or_default());
            Some(SurfaceRow([a.next()?, b.next()?, c.next()?, d, e]))
        });
        let mut rows: Vec<SurfaceRow<'_>> = rows.collect();
        let mut pairs = Vec::with_capacity(rows.len().div_ceil(2));
        let mut left = rows.drain(..);
        while let Some(first) = left.next() {
            pairs.push(std::iter::once(first).chain(left.next()).collect::<Vec<_>>());
        }
        drop(left);
        pairs.into_par_iter()
    }

    /// Takes away what `other` does not know.
    pub(super) fn forget_unknown_of(&mut self, other: &Self) {
        self.variance.values.par_iter_mut().zip(&other.variance.values).for_each(|(variance, other)| {
            *variance = if *other < f32::INFINITY { *variance } else { f32::INFINITY };
        });
    }

    /// The same at twice the resolution, for the surfaces of `fine`: along the planes of the discs.
    pub(super) fn doubled(&self, fine: &Observed, has_slants: bool) -> Self {
        let mut doubled = Self::unknown(fine.rows(), fine.columns, has_slants);
        doubled.par_row_pairs().enumerate().for_each(|(half, rows)| {
            let (d, variance, addition) =
                (self.disparity.row(half), self.variance.row(half), self.addition.row(half));
            let [p, q] = [0, 1].map(|along| self.slants[along].row(half));
            for ((y, SurfaceRow(row)), down) in (2 * half..).zip(rows).zip([-0.25, 0.25]) {
                let guess = fine.guess.row(y);
                for place in PAD..PAD + fine.columns {
                    let from = PAD + (place - PAD) / 2;
                    let across = if (place - PAD).is_multiple_of(2) { -0.25 } else { 0.25 };
                    let disparity = d[from] + p[from] * across + q[from] * down;
                    row[0][place] = disparity;
                    let same = OneSurface::ROUGH.holds(disparity - guess[place], 0.0);
                    row[1][place] = if same { variance[from] } else { f32::INFINITY };
                    row[2][place] = addition[from];
                    if has_slants {
                        row[3][place] = 0.5 * p[from];
                        row[4][place] = 0.5 * q[from];
                    }
                }
            }
        });
        doubled
    }
}

impl SurfaceRow<'_> {
    /// Puts what was found at every other and every next place from `start` on, where it serves.
    #[inline(always)]
    pub(super) fn put<S: Simd>(
        &mut self,
        simd: S,
        start: usize,
        serves: [mask32x16<S>; 2],
        [even, odd]: [[f32x16<S>; 5]; 2],
    ) {
        for (map, (even, odd)) in self.0.iter_mut().zip(even.into_iter().zip(odd)) {
            if map.is_empty() {
                continue;
            }
            let (first, second) = map[start..start + 2 * LANES].split_at_mut(LANES);
            let old = f32x16::from_slice(simd, first).deinterleave(f32x16::from_slice(simd, second));
            let new = (serves[0].select(even, old.0), serves[1].select(odd, old.1));
            let (low, high) = new.0.interleave(new.1);
            low.store_slice(first);
            high.store_slice(second);
        }
    }
}
