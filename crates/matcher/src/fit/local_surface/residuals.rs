//! What residuals of neighbours have in common: relief that discs smooth away, and noise that is
//! alike.
//!
//! Relief that is small against the noise of single observations is not seen by a disc, and no
//! covariance of a fit tells of it. Noise of resampled, averaged or binned frames is alike in
//! neighbouring pixels, so these tell less than as many independent ones. Both leave residuals r =
//! v - d alike. For pixels i and j whose observations have the weights w and errors with the
//! correlation rho
//!
//! ```text
//! E r_i r_j = h^2 - V + rho / sqrt(w_i w_j)
//! h^2: variance of the relief, V: that of the disparity, which both residuals share
//! ```
//!
//! Means over many pairs, weighted by w_i w_j, tell h^2 from pixels so far apart that their noise
//! is not alike, and the sum of rho from neighbours:
//!
//! ```text
//! V' = V g (1 + sum over neighbours of sqrt(w_i w_j) rho / sum of w) + h^2
//! ```
//!
//! g is the share of the noise of an observation that interpolation leaves: precisions are those of
//! the noise that is left in a sum of many, which interpolation does not change. White noise has g
//! (1 + ...) = 1.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::observed::Observed;
use super::pooling::{CELL, CELL_HALVINGS, halved_sums, pooled_cells};
use super::surface::Surface;
use crate::fit::padded::{PAD, Padded};

/// Columns and rows between pixels whose noise may be alike, one of each two opposite ones ...
const NEAR: [(usize, isize); 6] = [(1, 0), (0, 1), (1, 1), (1, -1), (2, 0), (0, 2)];
/// ... and between pixels whose noise is not, but whose relief is.
const FAR: [(usize, isize); 4] = [(3, 0), (0, 3), (2, 2), (2, -2)];
/// Noise that is alike in neighbours may be alike with either sign; means over many pairs leave at
/// least this.
const LEAST_RAISE: f32 = 0.5;
/// Chance leaves a mean beyond this many of its standard deviations once in forty.
const CHANCE_SIGMAS: f32 = 2.0;
/// A residual counts no more than this many of its standard deviations: it may be an outlier.
const LARGEST_RESIDUAL: f32 = 3.0;

/// Residuals over their standard deviations, and the roots of the precisions; zero where there is
/// none.
struct Residuals<'a> {
    surface: &'a Surface,
    normalised: Padded,
    roots: Padded,
    extent: (usize, usize),
}

/// Sums over pairs of pixels, by cells of the halved map.
struct Pairs {
    /// Of w_i w_j.
    weights: Padded,
    /// Of w_i w_j (r_i r_j + V).
    products: Padded,
}

impl<'a> Residuals<'a> {
    fn of(observed: &Observed, surface: &'a Surface) -> Self {
        let extent = (observed.rows(), observed.columns);
        let [mut roots, mut normalised] = [(); 2].map(|()| Padded::filled(extent.0, extent.1, 0.0));
        roots.par_rows().zip(normalised.par_rows()).enumerate().for_each(|(y, (roots, normalised))| {
            let (value, precision) = (observed.value.row(y), observed.precision.row(y));
            let (disparity, variance) = (surface.disparity.row(y), surface.variance.row(y));
            for place in PAD..PAD + extent.1 {
                if precision[place] > 0.0 && variance[place].is_finite() {
                    roots[place] = precision[place].sqrt();
                    let residual = roots[place] * (value[place] - disparity[place]);
                    normalised[place] = residual.clamp(-LARGEST_RESIDUAL, LARGEST_RESIDUAL);
                }
            }
        });
        Self { surface, normalised, roots, extent }
    }

    /// Sums over the pairs that lie so many columns and rows apart.
    fn pairs(&self, level: Level, offsets: &[(usize, isize)]) -> Pairs {
        let (rows, columns) = self.extent;
        let (down, across) = (rows.div_ceil(CELL), columns.div_ceil(CELL));
        let [mut weights, mut products] = [(); 2].map(|()| Padded::filled(down, across, 0.0));
        weights.par_rows().zip(products.par_rows()).enumerate().for_each(
            |(cell_row, (weights, products))| {
                // Of each column.
                let mut sums = vec![[0.0; 2]; columns];
                for y in CELL * cell_row..(CELL * (cell_row + 1)).min(rows) {
                    for &(right, down) in offsets {
                        let Some(other) = y.checked_add_signed(down).filter(|other| *other < rows) else {
                            continue;
                        };
                        dispatch!(level, _simd => self.add_pairs(y, other, right, &mut sums));
                    }
                }
                let cells = weights[PAD..].iter_mut().zip(&mut products[PAD..]).zip(sums.chunks(CELL));
                for ((weight, product), columns) in cells {
                    *weight = columns.iter().map(|sums| sums[0]).sum();
                    *product = columns.iter().map(|sums| sums[1]).sum();
                }
            },
        );
        Pairs { weights: pooled_cells(level, &weights), products: pooled_cells(level, &products) }
    }

    /// Adds the pairs of pixels of row `y` and those so many columns to the right in the `other` row.
    #[inline(always)]
    fn add_pairs(&self, y: usize, other: usize, right: usize, sums: &mut [[f32; 2]]) {
        let own = PAD..PAD + sums.len();
        let others = own.start + right..own.end + right;
        // What is added for step edges and relief is no noise.
        let maps = [&self.surface.variance, &self.surface.addition, &self.roots, &self.normalised];
        let [variance, addition, roots, residuals] = maps.map(|map| &map.row(y)[own.clone()]);
        let [other_roots, other_residuals] =
            [&self.roots, &self.normalised].map(|map| &map.row(other)[others.clone()]);
        for (index, [weight, product]) in sums.iter_mut().enumerate() {
            let root = roots[index] * other_roots[index];
            let alike = residuals[index] * other_residuals[index];
            let term = root * (alike + root * (variance[index] - addition[index]));
            *weight += root * root;
            *product += if root > 0.0 { term } else { 0.0 };
        }
    }
}

/// Raises the variances of `surface` by what residuals have in common.
pub(super) fn raise_by_residuals(level: Level, observed: &Observed, surface: &mut Surface, noise_gain: f32) {
    let residuals = Residuals::of(observed, surface);
    let (near, far) = (residuals.pairs(level, &NEAR), residuals.pairs(level, &FAR));
    let precisions = halved_sums(observed.precision.clone(), residuals.extent, CELL_HALVINGS);
    let precisions = pooled_cells(level, &precisions);
    surface.variance.par_rows().enumerate().for_each(|(y, variance)| {
        let row = y >> CELL_HALVINGS;
        for (place, variance) in variance.iter_mut().enumerate().skip(PAD).take(observed.columns) {
            let cell = PAD + ((place - PAD) >> CELL_HALVINGS);
            let at = |map: &Padded| map.row(row)[cell];
            if at(&far.weights) > 0.0 {
                let relief = at(&far.products) / at(&far.weights);
                let alike = 2.0 * (at(&near.products) - relief * at(&near.weights)) / at(&precisions);
                // Squared weights of a Gaussian sum to half of what weights do.
                let chance = CHANCE_SIGMAS * (0.5 / at(&far.weights)).sqrt();
                *variance =
                    *variance * (noise_gain * (1.0 + alike)).max(LEAST_RAISE) + (relief - chance).max(0.0);
            }
        }
    });
}
