//! Planes of neighbours, for pixels whose own plane is known much worse.
//!
//! A pixel whose window straddles a crease, or whose texture is weak, can have a plane so wrong that hardly
//! any observation belongs to it. Its sigma says so, and its neighbours' planes are better.

use rayon::prelude::*;

use super::carried::CarriedPlane;
use super::padded::{PAD, Padded};
use super::planes::SurfacePlanes;
use super::window_growth::LEAST_GAIN;

/// Planes are taken from this far along rows and columns, in px: as far as square windows that straddle
/// reach.
const REACH_PX: isize = 3;
/// Planes that differ from the pixel's own by more than this many standard deviations are of another surface;
/// chance exceeds it once in four hundred.
const OWN_SIGMAS: f32 = 3.0;
/// Relief between a pixel and its neighbour cannot be excluded, so the neighbour's plane leaves at least this
/// share of the pixel's own variance: it halves sigma at most.
const LEAST_LEFT: f32 = 0.25;

/// Where the variance exceeds `wanted`, in px^2, takes the plane among those of the neighbours that is known
/// best where it is carried to, if it is known much better than the pixel's own and does not contradict it.
/// Not where one of the witnesses of `relief` shows any, which carried planes would smooth away.
pub(super) fn take_neighbours(surface: &mut SurfacePlanes, wanted: f32, relief: &[&Padded]) {
    let found: Vec<Vec<(usize, CarriedPlane)>> = (0..surface.rows())
        .into_par_iter()
        .map(|y| {
            let places = PAD..surface.variance.row(y).len() - PAD;
            let poor = |&place: &usize| {
                let variance = surface.variance.row(y)[place];
                variance > wanted
                    && variance.is_finite()
                    && !relief.iter().any(|relief| relief.row(y)[place] > 0.0)
            };
            places
                .filter(poor)
                .filter_map(|place| Some((place, best_neighbour(surface, place, y)?)))
                .collect()
        })
        .collect();
    surface.take(&found);
}

/// The best-known plane of the neighbours, carried to the pixel, of those that it may take.
fn best_neighbour(surface: &SurfacePlanes, place: usize, y: usize) -> Option<CarriedPlane> {
    let own = surface.plane(place, y);
    let around = (1..=REACH_PX).flat_map(|away| [(-away, 0), (away, 0), (0, -away), (0, away)]);
    let carried = around.filter_map(|(u, v)| {
        // Rows above the image come out as huge numbers.
        let row = Some(y.wrapping_add_signed(v)).filter(|&row| row < surface.rows())?;
        let place = place.wrapping_add_signed(u);
        // Carried, a plane is known no better.
        if LEAST_GAIN * surface.variance.row(row)[place] >= own.variance {
            return None;
        }
        // The best of many is less well known than it says: both slants' variances count in full.
        Some(surface.plane(place, row).carried((-u as f32, -v as f32), 1.0))
    });
    let may_take = |plane: &CarriedPlane| {
        let apart = plane.disparity - own.disparity;
        LEAST_GAIN * plane.variance < own.variance
            && apart * apart < OWN_SIGMAS * OWN_SIGMAS * (own.variance + plane.variance)
    };
    let best = carried.filter(may_take).min_by(|one, other| one.variance.total_cmp(&other.variance))?;
    // Where two estimates differ by more than their sigmas explain, the variance grows by that factor (Birge
    // 1932).
    let expected = own.variance + best.variance;
    let unlike = ((best.disparity - own.disparity).powi(2) / expected).max(1.0);
    let floor = own.variance * LEAST_LEFT;
    Some(CarriedPlane { variance: (unlike * best.variance).max(floor), ..best })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: usize = 20;
    const COLUMNS: usize = 24;
    const WANTED: f32 = 1e-4;
    const SLANT_VARIANCE: f32 = 1e-6;
    /// The pixel that knows less.
    const POOR: (usize, usize) = (12, 9);
    const P: f32 = 0.03;
    const Q: f32 = -0.02;

    fn plane(x: usize, y: usize) -> f32 {
        2.0 + P * x as f32 + Q * y as f32
    }

    /// What the poor pixel, that lies `off` the plane with this variance, has afterwards; its neighbours have
    /// the variances that `around` gives, by columns and rows from it.
    fn taken(off: f32, variance: f32, around: impl Fn(isize, isize) -> f32, relief: f32) -> CarriedPlane {
        let mut surface = SurfacePlanes::unknown(ROWS, COLUMNS);
        for y in 0..ROWS {
            for x in 0..COLUMNS {
                surface.disparity.row_mut(y)[PAD + x] = plane(x, y);
                surface.slant_x.row_mut(y)[PAD + x] = P;
                surface.slant_y.row_mut(y)[PAD + x] = Q;
                let from_poor = (x as isize - POOR.0 as isize, y as isize - POOR.1 as isize);
                surface.variance.row_mut(y)[PAD + x] = around(from_poor.0, from_poor.1);
                surface.slant_variance.row_mut(y)[PAD + x] = SLANT_VARIANCE;
            }
        }
        surface.disparity.row_mut(POOR.1)[PAD + POOR.0] += off;
        surface.variance.row_mut(POOR.1)[PAD + POOR.0] = variance;
        surface.forget_fit();
        let before = surface.clone();
        take_neighbours(
            &mut surface,
            WANTED,
            &[&Padded::filled(ROWS, COLUMNS, f32::NAN), &Padded::filled(ROWS, COLUMNS, relief)],
        );
        let others = (0..ROWS).flat_map(|y| (0..COLUMNS).map(move |x| (x, y))).filter(|&pixel| pixel != POOR);
        for (x, y) in others {
            assert_eq!(surface.plane(PAD + x, y), before.plane(PAD + x, y), "{x} {y}");
        }
        surface.plane(PAD + POOR.0, POOR.1)
    }

    #[test]
    fn poor_pixels_take_the_neighbour_that_is_known_best_where_it_is_carried_to() {
        let good = WANTED / 2.0;
        // Next to the pixel, or so much better two rows on that the way there is worth it.
        for (better, variance) in
            [(None, good + SLANT_VARIANCE), (Some((0, 2)), good / 2.0 + 4.0 * SLANT_VARIANCE)]
        {
            let around = |u, v| if Some((u, v)) == better { good / 2.0 } else { good };
            let found = taken(0.01, 1.1 * WANTED, around, f32::NAN);
            assert!((found.disparity - plane(POOR.0, POOR.1)).abs() < 1e-6);
            assert_eq!((found.slant_x, found.slant_y), (P, Q));
            assert!((found.variance / variance - 1.0).abs() < 1e-5, "{found:?}");
        }
    }

    #[test]
    fn neighbours_halve_sigma_at_most_and_less_where_the_pixel_says_otherwise() {
        let good = WANTED / 2.0;
        let variance_of = |off: f32, variance: f32| taken(off, variance, |_, _| good, f32::NAN).variance;
        assert!((variance_of(0.01, 1e-3) / 2.5e-4 - 1.0).abs() < 1e-5);
        let carried = good + SLANT_VARIANCE;
        let unlike = 0.03 * 0.03 / (1.1 * WANTED + carried);
        assert!((variance_of(0.03, 1.1 * WANTED) / (unlike * carried) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn pixels_keep_what_is_good_enough_or_of_another_surface_or_relief() {
        let good = WANTED / 2.0;
        let kept = |off: f32, variance: f32, around: f32, relief: f32| {
            let found = taken(off, variance, |_, _| around, relief);
            found.variance == variance && found.disparity == plane(POOR.0, POOR.1) + off
        };
        assert!(!kept(0.03, 1e-3, good, f32::NAN) && !kept(0.03, 1e-3, good, 0.0));
        assert!(kept(0.03, WANTED, good, f32::NAN), "known as well as wanted");
        assert!(kept(0.03, 1e-3, 0.5e-3, f32::NAN), "neighbours are hardly better");
        assert!(kept(0.2, 1e-3, good, f32::NAN), "a step of six sigmas");
        assert!(kept(0.03, 1e-3, good, 1e-6), "relief shows");
        assert!(kept(0.03, 1e-3, f32::INFINITY, f32::NAN), "neighbours know nothing");
        assert!(kept(0.03, f32::INFINITY, good, f32::NAN), "no plane to compare with");
    }
}
