//! Adaptive support: which windows are tried, and in what order.
//!
//! 1. Windows of several shapes, centred on a pixel or beside it, compete for it; the best one's plane is the
//!    pixel's. At creases the planes of the faces decide.
//! 2. These planes tell which observations belong together. Around each pixel the smallest window that leaves
//!    the wanted sigma joins those that belong.
//! 3. Where no window does, wider ones may (`window_growth`), or the pixel takes a better known plane: that
//!    of step 1, or a neighbour's (`neighbours`).
//! 4. At creases the planes of the supports decide about the pixels that are left.

use fearless_simd::Level;
use rayon::prelude::*;

use super::creases::decide_creases;
use super::fit::Fit;
use super::foreshortening::take_off_drift;
use super::neighbours::take_neighbours;
use super::planes::{ObservationMaps, SpareMaps, SurfacePlanes};
use super::smoothing::{
    LEAST_SPARE, common_variance, disagreement, missed_by_small, own_variance, smoothed_away,
};
use super::support::{SupportRule, join_nested_row, join_row, nested_reaches, take_best_window};
use super::window_growth::{WIDE_REACHES, take_better, take_wide};
use crate::options::{Effort, LARGEST_GROWN_WINDOW_PX};
use epirig_core::grid::Grid;

/// Reaches of the windows of the steps before the last, in columns and rows.
const FIRST_REACH: (usize, usize) = (2, 2);
/// Reaches of the windows that compete for a pixel, in columns and rows: a square one, and long ones, which
/// see small steps along them. Narrower ones (see [`join_nested_row`]) fit between two steps.
const SQUARE_REACH: (usize, usize) = (3, 3);
const LONG_REACHES: [(usize, usize); 2] = [(3, 10), (10, 3)];
/// Reaches to which supports grow, in px.
const REACHES: [usize; 5] = [1, 2, 3, 4, LARGEST_GROWN_WINDOW_PX / 2];
/// Reaches of the small windows that show what supports smooth away, in px.
const SMALL_REACHES: [usize; 2] = [1, 2];
/// Disparities that differ by more than this many of their sigmas belong to two surfaces. Chance exceeds it
/// once in fifty. A wider limit lets more small steps into the support.
const BELONGS_SIGMAS: f32 = 2.3;
/// The same for windows whose size is given: chance exceeds it once in ten thousand.
const BELONGS_TO_FIXED: f32 = 4.0;
/// Mean square of u and v, in px^2, in the windows that show slants: 4 to 24 in those of 7 x 7 to 7 x 17,
/// usually 12.
const SLANT_SPREAD: f32 = 12.0;
/// The same for the smallest of them: windows of a given size then lose nothing of a plane that is known no
/// better.
const SLANT_SPREAD_OF_FIXED: f32 = 4.0;
/// Growth of a plane's variance where it is carried across a crease, over the variance by both slants: half
/// where supports are as wide as high, all where windows may be narrow across the crease.
const SHARE_OF_SUPPORTS: f32 = 0.5;
const SHARE_OF_NARROW: f32 = 1.0;
/// Guesses of one surface differ by their step, and for each px of distance by a slant this steep at most.
const GUESS_SLACK: (f32, f32) = (0.5, 0.3);
const NO_SLACK: (f32, f32) = (0.0, 0.0);

/// The surface through the observations: supports of the smallest window, or as `options` say.
pub(super) fn join_observations(
    level: Level,
    observations: &mut ObservationMaps,
    guess: &Grid<f32>,
    origin: f32,
    options: Option<Fit>,
) -> SurfacePlanes {
    let (rows, columns) = (guess.rows(), guess.columns());
    // A window of a given size is used as a whole.
    let quick = options.is_some_and(|options| options.effort == Effort::Quick);
    let fixed = options.is_none_or(|options| quick || options.wanted_sigma_px.is_infinite());
    let (belongs_sigmas, slant_spread) =
        if fixed { (BELONGS_TO_FIXED, SLANT_SPREAD_OF_FIXED) } else { (BELONGS_SIGMAS, SLANT_SPREAD) };
    let rule = |reach, slack: (f32, f32)| SupportRule {
        reach,
        belongs_sigmas,
        slant_spread,
        slack,
        slants_known: slack == NO_SLACK,
    };
    let join =
        |observations: &ObservationMaps, map: &SurfacePlanes, rule: SupportRule, mut next: SurfacePlanes| {
            next.par_rows().enumerate().for_each(|(y, out)| {
                join_row(level, (observations, map), rule, y, None, out);
            });
            next
        };
    let mut spare = SpareMaps::none(rows, columns);
    let guesses = SurfacePlanes::of_guesses(observations, guess, origin);
    let survey = |observations: &ObservationMaps, square, long: &[(usize, usize)], spare: &mut SpareMaps| {
        let mut map = spare.unknown();
        let mut take_best = |windows: &SurfacePlanes, reach| {
            map.par_rows()
                .enumerate()
                .for_each(|(y, out)| take_best_window(level, (windows, &guesses), reach, y, out));
        };
        let mut windows = join(observations, &guesses, rule(square, GUESS_SLACK), spare.windows());
        take_best(&windows, square);
        for &reach in long {
            let mut wider = [(); 2].map(|()| spare.windows());
            let [middle, widest] = &mut wider;
            let nested = windows.par_rows().zip(middle.par_rows()).zip(widest.par_rows());
            nested.enumerate().for_each(|(y, ((narrow, middle), wide))| {
                let rule = rule(reach, GUESS_SLACK);
                join_nested_row(level, (observations, &guesses), rule, y, [narrow, middle, wide]);
            });
            for (windows, reach) in [&windows, &wider[0], &wider[1]].into_iter().zip(nested_reaches(reach)) {
                take_best(windows, reach);
            }
            wider.into_iter().for_each(|wider| spare.keep(wider));
        }
        spare.keep(windows);
        map
    };
    let Some(options) = options else {
        let map = survey(observations, FIRST_REACH, &[], &mut spare);
        return join(observations, &map, rule(FIRST_REACH, NO_SLACK), spare.supports());
    };
    let least = options.window_px / 2;
    let side = |reach: usize| 2 * reach + 1;
    let [smallest, small] = SMALL_REACHES;
    let join_small = |observations: &ObservationMaps, reach: usize, planes: SurfacePlanes| {
        let mut small = join(observations, &guesses, rule((reach, reach), GUESS_SLACK), planes);
        small.forget_fit();
        small
    };
    if quick {
        let map = survey(observations, SQUARE_REACH, &[], &mut spare);
        take_off_drift(observations, &map);
        observations.forget_derivatives();
        let mut surface = join(observations, &map, rule((least, least), NO_SLACK), spare.supports());
        let smoothed = smoothed_away((&surface, &[]), &map, disagreement(&map));
        spare.keep(map);
        let windows = join_small(observations, smallest, spare.supports());
        let missed = missed_by_small(&surface, (&windows, side(smallest)), LEAST_SPARE);
        surface.raise_variance(&smoothed);
        surface.raise_variance(&own_variance(missed));
        return surface;
    }
    let map = survey(observations, SQUARE_REACH, &[], &mut spare);
    take_off_drift(observations, &map);
    observations.forget_derivatives();
    spare.keep(map);
    let mut map = survey(observations, SQUARE_REACH, &LONG_REACHES, &mut spare);
    decide_creases(&mut map, SHARE_OF_NARROW);
    map.forget_misfit();
    let observations = &*observations;
    let mut surface = join(observations, &map, rule((least, least), NO_SLACK), spare.supports());
    let wanted = options.wanted_sigma_px.powi(2) as f32;
    let grow = |surface: &mut SurfacePlanes, reaches: &[usize]| {
        for &reach in reaches.iter().filter(|&&reach| reach > least) {
            surface.par_rows().enumerate().for_each(|(y, out)| {
                join_row(level, (observations, &map), rule((reach, reach), NO_SLACK), y, Some(wanted), out);
            });
        }
    };
    grow(&mut surface, &REACHES);
    let disagreement = disagreement(&map);
    let windows = join_small(observations, small, spare.supports());
    if !fixed {
        let mut wide = spare.copy_of(&surface);
        grow(&mut wide, &WIDE_REACHES);
        for surface in [&mut surface, &mut wide] {
            take_better(surface, &map, wanted);
            let missed = missed_by_small(surface, (&windows, side(small)), LEAST_SPARE);
            take_neighbours(surface, wanted, &[&disagreement, &missed]);
        }
        wide.forget_fit();
        take_wide(&mut surface, &wide, (&windows, side(small)), &disagreement);
    }
    let creases = if fixed { Vec::new() } else { decide_creases(&mut surface, SHARE_OF_SUPPORTS) };
    let smoothed = smoothed_away((&surface, &creases), &map, disagreement);
    spare.release();
    drop(map);
    let missed = missed_by_small(&surface, (&windows, side(small)), LEAST_SPARE);
    drop(windows);
    let windows = join_small(observations, smallest, spare.supports());
    let missed_by_smallest = missed_by_small(&surface, (&windows, side(smallest)), LEAST_SPARE);
    surface.raise_variance(&smoothed);
    surface.raise_variance(&common_variance(missed_by_smallest, &missed));
    surface
}
