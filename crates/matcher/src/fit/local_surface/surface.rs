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
    /// What is to be added to it, in px^2: by edges that lie between the places that are tried, and
    /// by relief that larger discs smooth away.
    pub(super) addition: Padded,
    /// Slants of the plane through the disc, in px per pixel of the map, where they are needed.
    pub(super) slants: Option<[Padded; 2]>,
}

/// A row of each map.
pub(super) struct SurfaceRow<'a> {
    /// Disparity, variance and addition.
    maps: [&'a mut [f32]; 3],
    slants: Option<[&'a mut [f32]; 2]>,
}

impl Surface {
    pub(super) fn unknown(rows: usize, columns: usize, has_slants: bool) -> Self {
        let map = |value| Padded::filled(rows, columns, value);
        Self {
            disparity: map(0.0),
            variance: map(f32::INFINITY),
            addition: map(0.0),
            slants: has_slants.then(|| [map(0.0), map(0.0)]),
        }
    }

    /// Two rows at a time; the last may be alone.
    pub(super) fn par_row_pairs(&mut self) -> impl IndexedParallelIterator<Item = Vec<SurfaceRow<'_>>> {
        let stride = self.disparity.stride;
        let maps = [&mut self.disparity, &mut self.variance, &mut self.addition];
        let mut maps = maps.map(|map| map.values.chunks_mut(stride));
        let mut slants =
            self.slants.as_mut().map(|slants| slants.each_mut().map(|map| map.values.chunks_mut(stride)));
        let mut rows = std::iter::from_fn(move || {
            let [a, b, c] = &mut maps;
            let slants = match &mut slants {
                Some([p, q]) => Some([p.next()?, q.next()?]),
                None => None,
            };
            Some(SurfaceRow { maps: [a.next()?, b.next()?, c.next()?], slants })
        });
        let mut pairs = Vec::new();
        while let Some(first) = rows.next() {
            pairs.push(std::iter::once(first).chain(rows.next()).collect::<Vec<_>>());
        }
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
            let slants = self.slants.as_ref().map(|maps| maps.each_ref().map(|map| map.row(half)));
            for ((y, row), down) in (2 * half..).zip(rows).zip([-0.25, 0.25]) {
                let guess = fine.guess.row(y);
                let [disparities, variances, additions] = row.maps;
                let mut out = row.slants;
                for place in PAD..PAD + fine.columns {
                    let from = PAD + (place - PAD) / 2;
                    let across = if (place - PAD).is_multiple_of(2) { -0.25 } else { 0.25 };
                    let [p, q] = slants.map_or([0.0; 2], |slants| slants.map(|row| row[from]));
                    let disparity = d[from] + p * across + q * down;
                    disparities[place] = disparity;
                    let same = OneSurface::ROUGH.holds(disparity - guess[place], 0.0);
                    variances[place] = if same { variance[from] } else { f32::INFINITY };
                    additions[place] = addition[from];
                    if let Some(out) = &mut out {
                        (out[0][place], out[1][place]) = (0.5 * p, 0.5 * q);
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
        let maps = self.maps.iter_mut().chain(self.slants.iter_mut().flatten());
        for (map, (even, odd)) in maps.zip(even.into_iter().zip(odd)) {
            let (first, second) = map[start..start + 2 * LANES].split_at_mut(LANES);
            let old = f32x16::from_slice(simd, first).deinterleave(f32x16::from_slice(simd, second));
            let new = (serves[0].select(even, old.0), serves[1].select(odd, old.1));
            let (low, high) = new.0.interleave(new.1);
            low.store_slice(first);
            high.store_slice(second);
        }
    }
}
