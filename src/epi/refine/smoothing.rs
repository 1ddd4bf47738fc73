//! What supports smooth away.
//!
//! A step that is small against the noise of single votes is not seen by the window that it crosses, which then errs without knowing. Many windows
//! together know: where they smooth something away, they differ from small windows by more than the small ones' noise explains. The excess of the squared
//! differences, pooled along the column and along the row through a pixel, is the square of what is smoothed away there. Both pools must stand out: along a
//! straight step one of them always does, for pixels beside the step, too.

use super::planes::{PAD, Padded, SurfacePlanes};

/// Pools reach this far to both sides, in px.
const POOL_REACH: usize = 40;
/// A pool stands out if its excess is this many of its standard deviations; chance lets both do so once in two thousand.
const STANDS_OUT: f64 = 2.0;

/// Sums over a pool, weighted by how well each squared difference is known.
#[derive(Debug, Clone, Copy, Default)]
struct Pool {
    excess: f64,
    weight: f64,
}

impl Pool {
    fn change(&mut self, other: &Self, sign: f64) {
        self.excess += sign * other.excess;
        self.weight += sign * other.weight;
    }

    /// The mean excess, if it stands out; windows of `side` px share their votes with neighbours.
    fn standing_out(&self, side: usize) -> f64 {
        let mean = self.excess / self.weight;
        if mean > STANDS_OUT * (side as f64 / self.weight).sqrt() { mean } else { 0.0 }
    }
}

/// Raises `smoothed`, in px^2, to the squares of what `surface` smooths away against `small`, the planes of windows `side` px wide.
pub(super) fn raise_smoothed(
    smoothed: &mut Padded,
    surface: &SurfacePlanes,
    small: &SurfacePlanes,
    side: usize,
) {
    let rows = surface.rows();
    let own: Vec<Vec<Pool>> = (0..rows)
        .map(|y| {
            let (found, variance) = (surface.disparity.row(y), surface.variance.row(y));
            let (other, noise) = (small.disparity.row(y), small.variance.row(y));
            (PAD..found.len() - PAD)
                .map(|place| {
                    let noise = f64::from(noise[place]);
                    let spare = noise - f64::from(variance[place]);
                    if !(spare > 0.2 * noise && spare.is_finite()) {
                        return Pool::default();
                    }
                    let difference = f64::from(other[place] - found[place]);
                    // The square of a Gaussian has twice its squared variance for variance.
                    let weight = 0.5 / (spare * spare);
                    Pool { excess: weight * (difference * difference - spare), weight }
                })
                .collect()
        })
        .collect();
    let columns = own.first().map_or(0, Vec::len);
    let mut vertical = vec![Pool::default(); columns];
    for row in own.iter().take(POOL_REACH) {
        vertical.iter_mut().zip(row).for_each(|(pool, pixel)| pool.change(pixel, 1.0));
    }
    for y in 0..rows {
        if let Some(row) = own.get(y + POOL_REACH) {
            vertical.iter_mut().zip(row).for_each(|(pool, pixel)| pool.change(pixel, 1.0));
        }
        if let Some(row) = y.checked_sub(POOL_REACH + 1).map(|gone| &own[gone]) {
            vertical.iter_mut().zip(row).for_each(|(pool, pixel)| pool.change(pixel, -1.0));
        }
        let row = &own[y];
        let mut horizontal = Pool::default();
        row.iter().take(POOL_REACH).for_each(|pixel| horizontal.change(pixel, 1.0));
        let smoothed = smoothed.row_mut(y);
        for x in 0..columns {
            if let Some(pixel) = row.get(x + POOL_REACH) {
                horizontal.change(pixel, 1.0);
            }
            if let Some(gone) = x.checked_sub(POOL_REACH + 1) {
                horizontal.change(&row[gone], -1.0);
            }
            let (along, across) = (vertical[x].standing_out(side), horizontal.standing_out(side));
            if along > 0.0 && across > 0.0 {
                smoothed[PAD + x] = smoothed[PAD + x].max(along.max(across) as f32);
            }
        }
    }
}
