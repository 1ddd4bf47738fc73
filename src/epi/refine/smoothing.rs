//! What supports smooth away.
//!
//! A step that is small against the noise of single votes is not seen by the window that it crosses, which then errs without knowing. Many windows
//! together know: where they smooth something away, they differ from small windows by more than the small ones' noise explains. The excess of the squared
//! differences, pooled along the column and along the row through a pixel, is the square of what is smoothed away there. Both pools must stand out: along a
//! straight step one of them always does, for pixels beside the step, too.

use rayon::prelude::*;

use super::planes::{PAD, Padded, SurfacePlanes};

/// Pools reach this far to both sides, in px.
const POOL_REACH: usize = 40;
/// A small window this far away has not seen what is smoothed away, but another surface, in px.
const ANOTHER_SURFACE_PX: f64 = 0.5;
/// A pool stands out if its excess is this many of its standard deviations; chance lets both do so once in a thousand.
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
        .into_par_iter()
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
                    if difference.abs() > ANOTHER_SURFACE_PX {
                        return Pool::default();
                    }
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

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const ROWS: usize = 200;
    const COLUMNS: usize = 240;
    /// Windows of three pixels.
    const SIDE: usize = 3;
    const SMALL_SIGMA: f32 = 0.01;

    /// A surface without noise that lies `lift(x)` beside small windows whose noise is that of means over 3 x 3 px.
    fn surfaces(lift: impl Fn(usize) -> f32) -> (SurfacePlanes, SurfacePlanes) {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let stride = COLUMNS + 2;
        let white: Vec<f32> = (0..(ROWS + 2) * stride).map(|_| StandardNormal.sample(&mut random)).collect();
        let mut surface = SurfacePlanes::unknown(ROWS, COLUMNS);
        let mut small = SurfacePlanes::unknown(ROWS, COLUMNS);
        for y in 0..ROWS {
            surface.variance.row_mut(y)[PAD..PAD + COLUMNS].fill(0.0);
            small.variance.row_mut(y)[PAD..PAD + COLUMNS].fill(SMALL_SIGMA * SMALL_SIGMA);
            for x in 0..COLUMNS {
                let window = (0..SIDE).flat_map(|v| &white[(y + v) * stride + x..][..SIDE]);
                // The sum of nine has the sigma 3.
                small.disparity.row_mut(y)[PAD + x] = 7.0 + SMALL_SIGMA / 3.0 * window.sum::<f32>();
                surface.disparity.row_mut(y)[PAD + x] = 7.0 + lift(x);
            }
        }
        (surface, small)
    }

    fn raised(surface: &SurfacePlanes, small: &SurfacePlanes) -> Padded {
        let mut smoothed = Padded::filled(ROWS, COLUMNS, 0.0);
        raise_smoothed(&mut smoothed, surface, small, SIDE);
        smoothed
    }

    fn share_raised(smoothed: &Padded, columns: std::ops::Range<usize>) -> f64 {
        let count = |y| columns.clone().filter(|x| smoothed.row(y)[PAD + x] > 0.0).count();
        (0..ROWS).map(count).sum::<usize>() as f64 / (ROWS * columns.len()) as f64
    }

    #[test]
    fn noise_alone_raises_next_to_nothing() {
        let (surface, small) = surfaces(|_| 0.0);
        let share = share_raised(&raised(&surface, &small), 0..COLUMNS);
        // Two Gaussian pools stand out by chance once in two thousand; means of 81 squares are skew (third moment 0.31), which makes
        // it once in a thousand. Pools overlap: here are some 500 independent ones of either kind, so the share may well be twice that.
        assert!(share < 2.0 / 1000.0, "{share}");
    }

    #[test]
    fn what_a_band_smooths_away_is_stated_in_the_band() {
        // Twelve of a row's 81 pixels: an excess of 0.00037 +- 0.00007, where 0.00005 stands out.
        let band = 120..132;
        let (surface, small) = surfaces(|x| if band.contains(&x) { 0.05 } else { 0.0 });
        let smoothed = raised(&surface, &small);
        for y in 0..ROWS {
            for x in band.clone() {
                let found = smoothed.row(y)[PAD + x];
                // The mean over 81 rows, at the border 41, of (0.05 + noise)^2 - 0.01^2: noise of 0.01, of which three neighbours share a
                // window, gives it a standard deviation of 0.001 sqrt(3 / 41) = 0.00027 at the border.
                assert!((found - 0.0025).abs() < 4.0 * 0.00027, "({x}, {y}): {found}");
            }
        }
        // Out of the band's reach nothing but chance, as above.
        for far in [0..band.start - POOL_REACH, band.end + POOL_REACH..COLUMNS] {
            assert!(share_raised(&smoothed, far.clone()) < 2.0 / 2000.0, "{far:?}");
        }
        // Beside it rows tell of the band, but columns do not: less than one in twenty by chance, and by no more than the band's share of the row's pool.
        for near in [band.start - POOL_REACH..band.start, band.end..band.end + POOL_REACH] {
            assert!(share_raised(&smoothed, near.clone()) < 0.05, "{near:?}");
            let most = near.map(|x| (0..ROWS).map(|y| smoothed.row(y)[PAD + x]).fold(0.0, f32::max));
            assert!(most.fold(0.0, f32::max) < 2.0 * 0.0025 * 12.0 / 81.0);
        }
    }

    #[test]
    fn what_is_known_already_is_never_lowered_and_unknown_pixels_tell_nothing() {
        let (surface, mut small) = surfaces(|x| if x == 120 { 0.05 } else { 0.0 });
        let mut smoothed = Padded::filled(ROWS, COLUMNS, 1.0);
        raise_smoothed(&mut smoothed, &surface, &small, SIDE);
        assert!((0..ROWS).all(|y| smoothed.row(y).iter().all(|&value| value == 1.0)));
        for y in 0..ROWS {
            small.variance.row_mut(y).fill(f32::INFINITY);
        }
        assert_eq!(share_raised(&raised(&surface, &small), 0..COLUMNS), 0.0);
    }
}
