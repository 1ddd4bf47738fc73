//! Cost aggregation across rows, on scenes whose truth is known in closed form.

use crate::candidates::DisparityRange;
use crate::lines::{EpiLines, SeenRule};
use crate::maps::OrderingUsed;
use crate::options::{MatchError, MatchOptions, Occlusion, Search};
use crate::search::tests::{searched, texture, volume};
use crate::search::{SearchResult, Task, search};
use epirig_core::grid::Grid;
use epirig_core::progress::Silent;
use epirig_core::statistics::upper_median;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

/// Noise of a pixel of the frame at `tau`: 1 DN, uniformly distributed, in units of a shade.
fn noise(x: f64, y: usize, tau: f64) -> f64 {
    12.0_f64.sqrt() / 200.0 * (texture(x, y, 77 + (1e9 * tau) as u64, 1.0) - 0.5)
}

/// Shares of the answered pixels whose candidate is wrong by more than 0.5 px and by more than 2 px.
fn wrong(found: &SearchResult, truth: impl Fn(usize, usize) -> f64) -> [f64; 2] {
    let (mut answered, mut wrong) = (0.0_f64, [0.0; 2]);
    // Beyond these columns candidates leave the image.
    for (x, y) in (20..220).flat_map(|x| (0..found.guess.rows()).map(move |y| (x, y))) {
        let error = (f64::from(found.guess.at(x, y)) - truth(x, y)).abs();
        answered += f64::from(u8::from(!error.is_nan()));
        for (count, limit) in wrong.iter_mut().zip([0.5, 2.0]) {
            *count += f64::from(u8::from(error > limit));
        }
    }
    assert!(answered >= 0.9 * (200 * found.guess.rows()) as f64, "{answered}");
    wrong.map(|count| count / answered)
}

#[test]
fn rows_that_help_each_other_see_a_surface_that_each_by_itself_hardly_sees() {
    let tau = Tau::equidistant(40).unwrap();
    // A bowed surface that slants by up to 0.15 px from row to row; nothing of its texture goes on from row
    // to row.
    let disparity = |y: usize| 14.0 + 1.5 * (y as f64 / 20.0 - 1.0).powi(2);
    let scene = volume(40, 240, &tau, |x, y, tau| {
        let origin = x - disparity(y) * (tau - 0.5);
        0.4 + 3.0 / 200.0 * texture(origin, y, 21, 3.0) + noise(x, y, tau)
    });
    let middle = tau.middle_frame();
    for (search, ordering) in [
        (Search::Factorised, OrderingUsed::On),
        (Search::Factorised, OrderingUsed::Off),
        (Search::Exhaustive, OrderingUsed::On),
        (Search::Exhaustive, OrderingUsed::Off),
    ] {
        let options = MatchOptions { search, min_confidence: 0.0, ..MatchOptions::default() };
        let [alone, together] = [false, true].map(|semi_global| {
            let options = MatchOptions { semi_global, ..options.clone() };
            wrong(&searched(&scene, middle, ordering, &options), |_, y| disparity(y))
        });
        // The option's promise: of candidates far from the surface fewer than half are left; those near it
        // become no more.
        assert!(together[0] < alone[0], "{search:?} {ordering:?}: {together:?} {alone:?}");
        assert!(together[1] < 0.5 * alone[1], "{search:?} {ordering:?}: {together:?} {alone:?}");
    }
}

#[test]
fn edges_across_the_rows_stay_where_texture_shows_them() {
    let tau = Tau::equidistant(40).unwrap();
    let disparity = |y: usize| if (y / 6).is_multiple_of(2) { 9.0 } else { 15.0 };
    let scene = volume(36, 240, &tau, |x, y, tau| {
        0.05 + 0.9 * texture(x - disparity(y) * (tau - 0.5), y, 22, 3.0) + noise(x, y, tau)
    });
    for ordering in [OrderingUsed::On, OrderingUsed::Off] {
        let [alone, together] = [false, true].map(|semi_global| {
            // Windows of a single pixel, so that edges are where the mapping or the best candidates put them.
            let options = MatchOptions { semi_global, window_px: 1, ..MatchOptions::default() };
            wrong(&searched(&scene, tau.middle_frame(), ordering, &options), |_, y| disparity(y))
        });
        assert!(together[0] <= alone[0] && together[1] <= alone[1], "{ordering:?}: {together:?} {alone:?}");
    }
}

#[test]
fn costs_told_are_the_pixels_own_and_strong_texture_needs_no_help() {
    let tau = Tau::equidistant(40).unwrap();
    let scene =
        volume(30, 240, &tau, |x, y, tau| 0.1 + 0.8 * texture(x - 11.0 * tau, y, 23, 3.0) + noise(x, y, tau));
    for (search, ordering) in [
        (Search::Factorised, OrderingUsed::On),
        (Search::Exhaustive, OrderingUsed::On),
        (Search::Exhaustive, OrderingUsed::Off),
    ] {
        let [alone, together] = [false, true].map(|semi_global| {
            let options = MatchOptions { search, semi_global, ..MatchOptions::default() };
            searched(&scene, 0, ordering, &options)
        });
        let mut costs: Vec<f32> =
            together.cost.values().iter().copied().filter(|cost| !cost.is_nan()).collect();
        let typical = upper_median(&mut costs).unwrap();
        // A candidate and the vertex beside it, less than half a step away.
        let disparity_step_px = if search == Search::Factorised { 0.5 } else { 0.25 };
        let candidate = |found: &SearchResult, index: usize| {
            Some((found.guess.values()[index] / disparity_step_px).round()).filter(|k| !k.is_nan())
        };
        let (mut answered, mut same) = (0, 0);
        for index in 0..alone.guess.values().len() {
            let Some(k) = candidate(&alone, index) else { continue };
            answered += 1;
            if candidate(&together, index) == Some(k) {
                same += 1;
                let [a, b] = [&alone, &together].map(|found| found.cost.values()[index]);
                // Half a count: a 32nd of sqrt(4 / (39 * 9)) of the cost that is typical of a few rows, which
                // is below twice that of all.
                assert!((a - b).abs() <= 0.007 * typical, "{search:?} {ordering:?}: {a} {b} {typical}");
            }
        }
        assert!(answered > 30 * 200);
        assert!(
            f64::from(same) >= 0.98 * f64::from(answered),
            "{search:?} {ordering:?}: {same} of {answered}"
        );
    }
}

#[test]
fn help_does_not_depend_on_the_number_of_threads() {
    let tau = Tau::equidistant(12).unwrap();
    let scene = volume(90, 120, &tau, |x, y, tau| {
        0.4 + 4.0 / 200.0 * texture(x - 9.0 * tau, y, 24, 3.0) + noise(x, y, tau)
    });
    for (search, ordering) in [
        (Search::Factorised, OrderingUsed::On),
        (Search::Factorised, OrderingUsed::Off),
        (Search::Exhaustive, OrderingUsed::Off),
    ] {
        let options = MatchOptions { search, semi_global: true, ..MatchOptions::default() };
        let bits = |threads| -> Vec<u32> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let SearchResult { guess, cost, confidence, .. } =
                pool.install(|| searched(&scene, 4, ordering, &options));
            [guess, cost, confidence].iter().flat_map(Grid::values).map(|value| value.to_bits()).collect()
        };
        assert_eq!(bits(1), bits(3), "{search:?} {ordering:?}");
    }
}

#[test]
fn a_range_too_wide_to_be_held_is_refused_before_anything_is_searched() {
    let tau = Tau::equidistant(3).unwrap();
    let volume = Volume::new(4, 3000, 8, tau.clone());
    let lines = EpiLines::new(&tau, 0, 3000);
    let rule = SeenRule::new(3, 0.5, Occlusion::None);
    let range = DisparityRange { minimum_px: -1000.0, maximum_px: 1000.0 };
    for search_by in [Search::Factorised, Search::Exhaustive] {
        let options = MatchOptions { search: search_by, semi_global: true, ..MatchOptions::default() };
        let task = Task {
            volume: &volume,
            lines: &lines,
            range,
            ordering: OrderingUsed::On,
            rule,
            options: &options,
            progress: &Silent,
        };
        let refused = search(task).err().unwrap();
        assert!(matches!(refused, MatchError::TooManyToAggregate { .. }), "{refused}");
        assert!(refused.to_string().contains("narrower range"), "{refused}");
    }
}
