//! Window growth: wide supports for weak texture, where the surface shows no relief that they would smooth
//! away.
//!
//! On a plane, a wider window is always better. On relief below the noise of single windows, a wide window
//! gives a plane with a small sigma, and is wrong. So wide supports are taken only where pools of many pixels
//! (see `smoothing`) show no relief: windows that competed for the pixels agree, narrow supports keep what
//! small windows see, and wide supports agree with narrow ones.

use super::padded::Padded;
use super::planes::SurfacePlanes;
use super::smoothing::{LEAST_SPARE, missed_by_small};
use crate::options::LARGEST_FIT_WINDOW_PX;

/// Reaches of wide supports, in px.
pub(super) const WIDE_REACHES: [usize; 2] = [7, LARGEST_FIT_WINDOW_PX / 2];
/// Wide supports tell of relief where they leave narrow ones this share of the variance less.
const LEAST_LESS: f64 = 0.1;
/// Planes of the windows that competed are taken for the surface's if their variance is smaller by this: the
/// best of many is less well known than it says.
pub(super) const LEAST_GAIN: f32 = 2.0;

/// Where the widest support leaves more than the `wanted` variance, in px^2, takes the planes of `map`, whose
/// windows are longer, if they are known much better.
pub(super) fn take_better(surface: &mut SurfacePlanes, map: &SurfacePlanes, wanted: f32) {
    surface.take_where(map, |_, _, [variance, of_map]| variance > wanted && LEAST_GAIN * of_map < variance);
}

/// Takes the planes of `wide` supports where no relief shows. `small` are windows with their side in px,
/// `disagreement` is the pooled disagreement of the windows that competed, in px^2; NaN where it is not
/// significant.
pub(super) fn take_wide(
    surface: &mut SurfacePlanes,
    wide: &SurfacePlanes,
    small: (&SurfacePlanes, usize),
    disagreement: &Padded,
) {
    let [.., widest] = WIDE_REACHES;
    let missed = missed_by_small(surface, small, LEAST_SPARE);
    let lost = missed_by_small(wide, (surface, 2 * widest + 1), LEAST_LESS);
    surface.take_where(wide, |place, y, _| {
        ![disagreement, &missed, &lost].iter().any(|relief| relief.row(y)[place] > 0.0)
    });
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::refine::padded::PAD;

    const ROWS: usize = 200;
    const COLUMNS: usize = 240;
    const SIGMA_PX: f32 = 0.01;

    /// The share of the pixels that take wide supports, which see no relief, where narrow ones see `relief`,
    /// small windows see `more` of it, and windows that competed disagree by `apart`.
    fn share_taken(relief: impl Fn(usize) -> f32, more: f32, apart: f32) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let [mut surface, mut wide, mut small] = [(); 3].map(|()| SurfacePlanes::unknown(ROWS, COLUMNS));
        for y in 0..ROWS {
            for x in 0..COLUMNS {
                let [narrow, smallest]: [f32; 2] = [(); 2].map(|()| StandardNormal.sample(&mut random));
                let seen = relief(x) + SIGMA_PX * narrow;
                surface.disparity.row_mut(y)[PAD + x] = seen;
                // Small windows have as much noise again.
                small.disparity.row_mut(y)[PAD + x] = seen + more * relief(x) + SIGMA_PX * smallest;
            }
            wide.variance.row_mut(y).fill(0.0);
            surface.variance.row_mut(y).fill(SIGMA_PX * SIGMA_PX);
            small.variance.row_mut(y).fill(2.0 * SIGMA_PX * SIGMA_PX);
        }
        surface.forget_misfit();
        wide.forget_fit();
        small.forget_fit();
        let disagreement = Padded::filled(ROWS, COLUMNS, apart);
        take_wide(&mut surface, &wide, (&small, 1), &disagreement);
        let taken = (0..ROWS).flat_map(|y| &surface.variance.row(y)[PAD..PAD + COLUMNS]);
        taken.filter(|&&variance| variance == 0.0).count() as f64 / (ROWS * COLUMNS) as f64
    }

    #[test]
    fn wide_supports_are_taken_unless_one_witness_sees_relief() {
        let flat = |_: usize| 0.0;
        // Stripes of twice the noise, as wide windows are taken to be alike over 21 x 21 px: those in a
        // corner are four independent ones.
        let stripes = |x: usize| if (x / 6).is_multiple_of(2) { 2.0 * SIGMA_PX } else { -2.0 * SIGMA_PX };
        // Squares are significant by chance once in a hundred and fifty; those around pixels of such a field are a
        // few dozen independent ones.
        assert!(share_taken(flat, 0.0, f32::NAN) > 0.9);
        assert_eq!(share_taken(flat, 0.0, 1e-6), 0.0);
        assert_eq!(share_taken(stripes, 0.0, f32::NAN), 0.0);
        // Narrow supports see a tenth of it, as good as nothing, and small windows all.
        let faint = |x: usize| 0.1 * stripes(x);
        assert!(share_taken(faint, 0.0, f32::NAN) > 0.9);
        assert_eq!(share_taken(faint, 9.0, f32::NAN), 0.0);
    }

    #[test]
    fn planes_that_are_known_much_better_are_taken_where_supports_do_not_suffice() {
        const WANTED: f32 = 1.0;
        // The support's variance, the plane's, and whether the plane is taken.
        let cases = [(0.9, 0.1, false), (3.0, 1.6, false), (3.0, 1.4, true), (3.0, f32::INFINITY, false)];
        let [mut surface, mut map] = [(); 2].map(|()| SurfacePlanes::unknown(1, cases.len()));
        for (x, &(support, plane, _)) in cases.iter().enumerate() {
            surface.variance.row_mut(0)[PAD + x] = support;
            map.variance.row_mut(0)[PAD + x] = plane;
            map.disparity.row_mut(0)[PAD + x] = 7.0;
            map.slant_x.row_mut(0)[PAD + x] = 0.2;
            map.slant_y.row_mut(0)[PAD + x] = 0.3;
            map.slant_variance.row_mut(0)[PAD + x] = 0.4;
        }
        take_better(&mut surface, &map, WANTED);
        for (x, &(support, plane, taken)) in cases.iter().enumerate() {
            let found = surface.plane(PAD + x, 0);
            let expected =
                if taken { [7.0, 0.2, 0.3, plane, 0.4] } else { [0.0, 0.0, 0.0, support, f32::INFINITY] };
            let found = [found.disparity, found.slant_x, found.slant_y, found.variance, found.slant_variance];
            assert_eq!(found, expected, "{support} {plane}");
        }
    }
}
