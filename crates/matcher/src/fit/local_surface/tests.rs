use fearless_simd::{Level, SimdBase, dispatch, f32x16};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::approximate::{power_of_two, rough_logarithm};
use super::disc::{directions, points};
use super::model::EdgePriors;
use super::sizes::usual_odds;
use super::*;
use epirig_core::grid::Grid;
use epirig_core::progress::Silent;

const ROWS: usize = 40;
const COLUMNS: usize = 70;
const MODEL: Model = Model {
    shapes: [Shapes::PlanesAndEdges; 2],
    blur: 0.0,
    least_texture: 0.0,
    wanted_variance: f32::INFINITY,
};

/// Observations of a surface by column and row, with this precision in 1/px^2, around a guess of 0
/// or as given.
fn observed(
    precision: f32,
    surface: impl Fn(f32, f32) -> f32,
    guess: impl Fn(f32, f32) -> f32,
) -> Observed<'static> {
    let map = |value: &dyn Fn(f32, f32) -> f32, beside: f32| {
        let mut map = Padded::filled(ROWS, COLUMNS, beside);
        for y in 0..ROWS {
            for x in 0..COLUMNS {
                map.row_mut(y)[PAD + x] = value(x as f32, y as f32);
            }
        }
        map
    };
    Observed {
        value: map(&surface, 0.0),
        precision: map(&|_, _| precision, 0.0),
        guess: map(&guess, f32::NAN),
        columns: COLUMNS,
        progress: &Silent,
    }
}

/// The largest error at pixels for which `counts` says so.
fn largest_error(found: &Surface, truth: impl Fn(f32, f32) -> f32, counts: impl Fn(f32, f32) -> bool) -> f32 {
    let pixels = (0..ROWS).flat_map(|y| (0..COLUMNS).map(move |x| (x, y)));
    let inside = pixels.filter(|&(x, y)| counts(x as f32, y as f32));
    inside
        .map(|(x, y)| (found.disparity.row(y)[PAD + x] - truth(x as f32, y as f32)).abs())
        .fold(0.0, f32::max)
}

/// Whether the large disc lies in the image.
fn inside(x: f32, y: f32) -> bool {
    (8.0..COLUMNS as f32 - 8.0).contains(&x) && (8.0..ROWS as f32 - 8.0).contains(&y)
}

#[test]
fn powers_and_logarithms_are_as_exact_as_they_say() {
    dispatch!(Level::new(), simd => {
        for index in 0..1600_u16 {
            let exponent = 80.0 - 0.1 * f32::from(index);
            let power = power_of_two(simd, f32x16::splat(simd, exponent)).as_slice()[0];
            let exact = f64::from(exponent).exp2();
            assert!((f64::from(power) / exact - 1.0).abs() < 1e-4, "2^{exponent}: {power}");
            let value = exact as f32 * 1e6;
            let logarithm = rough_logarithm(simd, f32x16::splat(simd, value)).as_slice()[0];
            assert!((logarithm - value.log2()).abs() < 0.05, "{value}: {logarithm}");
        }
    });
}

#[test]
fn discs_have_the_pixels_that_they_say_and_strips_hold_each_once() {
    for (squared_radius, count) in [(SMALL, 32), (LARGE, 164)] {
        let points = points(squared_radius);
        assert_eq!(points.len(), count);
        for direction in directions(&points) {
            let mut order = direction.points.clone();
            order.sort_unstable();
            assert!(order.iter().enumerate().all(|(index, point)| usize::from(*point) == index));
            assert_eq!(usize::from(*direction.ends.last().unwrap()), points.len());
        }
    }
}

#[test]
fn planes_are_found_as_they_are_and_known_as_well_as_discs_allow() {
    let plane = |x: f32, y: f32| 0.01 * x - 0.02 * y + 0.3;
    let observed = observed(100.0, plane, plane);
    let found = surface(Level::new(), &observed, MODEL).unwrap();
    // The prior of slants takes 0.7 % of them in a disc of 32 pixels, which half a pixel from its
    // middle are 7e-5.
    let error = largest_error(&found, plane, inside);
    assert!(error < 1e-4, "{error}");
    let variance = found.variance.row(ROWS / 2)[PAD + COLUMNS / 2];
    let bound = 1.0 / (100.0 * 164.0);
    assert!(variance > bound && variance < 3.0 * bound, "{variance} {bound}");
}

#[test]
fn steps_at_any_angle_end_discs() {
    // On the directions that are tried first and last, and between all.
    for degrees in (0..16_u8).flat_map(|index| [0.0, 0.37].map(|part| 11.25 * (f32::from(index) + part))) {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let across = |x: f32, y: f32| cosine * (x - 35.3) + sine * (y - 20.2);
        let step = |x: f32, y: f32| if across(x, y) > 0.0 { 0.2 } else { 0.0 };
        // A step of 0.2 px is ten sigma of single observations.
        let observed = observed(2500.0, step, |_, _| 0.0);
        let found = surface(Level::new(), &observed, MODEL).unwrap();
        // Two pixels from the edge less is left than a single observation scatters by, which is a
        // tenth of the step. A plane through the smallest disc would leave a quarter.
        let error = largest_error(&found, step, |x, y| inside(x, y) && across(x, y).abs() > 2.0);
        assert!(error < 0.02, "{degrees}: {error}");
    }
}

#[test]
fn noise_may_carry_an_observation_from_its_guess_and_a_step_may_not() {
    const TRUTH: f32 = 0.8;
    let kept = |sigma: f32, away: f32| {
        let [weight, moment, inverse, noise] =
            [0.0, 0.0, 0.0, 1.0].map(|value| Padded::filled(ROWS, COLUMNS, value));
        let mut maps = ObservationMaps { weight, moment, inverse, noise_gain: 1.0, noise };
        let weight = 1.0 / (sigma * sigma);
        for (x, y) in (0..ROWS).flat_map(|y| (0..COLUMNS).map(move |x| (x, y))) {
            let value = TRUTH + if (x + y) % 2 == 0 { away } else { -away };
            maps.weight.row_mut(y)[PAD + x] = weight;
            maps.moment.row_mut(y)[PAD + x] = weight * value;
            maps.inverse.row_mut(y)[PAD + x] = 1.0 / weight;
        }
        let observed =
            Observed::of(&maps, Guess { map: &Grid::filled(ROWS, COLUMNS, 0.0), origin: 0.0 }, &Silent);
        let found = surface(Level::new(), &observed, MODEL).unwrap();
        let kept = observed.precision.row(3)[PAD..PAD + COLUMNS].iter().filter(|one| **one > 0.0).count();
        (kept, largest_error(&found, |_, _| TRUTH, inside))
    };
    // Of 0.3 and 1.3 px both are kept. Without those farther than 1 px the mean would be off by 0.5
    // px.
    let (all, error) = kept(1.0, 0.5);
    assert!(all == COLUMNS && error < 0.25, "{all}: {error}");
    // The more so if noise carries all of them that far.
    assert_eq!(kept(5.0, 5.0).0, COLUMNS);
    let (none, _) = kept(0.01, 5.0);
    assert_eq!(none, 0);
}

#[test]
fn the_usual_odds_are_those_of_most_places() {
    let observed = observed(1.0, |_, _| 0.0, |_, _| 0.0);
    // In nine tenths of the columns the larger disc predicts better by far, elsewhere the smaller
    // one.
    let odds = |place: usize, _| Some(if (place - PAD) * 10 < 9 * COLUMNS { 1e6 } else { 1e-6 });
    let found = usual_odds(&observed, odds);
    // 16 of the 18 columns that are looked at.
    assert!((found - 8.0).abs() < 0.01, "{found}");
    // What cannot be compared says nothing.
    let compared = |place: usize, y: usize| if place.is_multiple_of(8) { odds(place, y) } else { None };
    assert!(usual_odds(&observed, compared) > 4.0);
}

#[test]
fn other_surfaces_do_not_take_part() {
    let edge = |x: f32, _: f32| if x < 30.5 { 0.0 } else { 5.0 };
    let observed = observed(400.0, edge, edge);
    let found = surface(Level::new(), &observed, MODEL).unwrap();
    assert!(largest_error(&found, edge, |_, _| true) < 1e-3);
}

#[test]
fn pixels_without_a_guess_stay_unknown() {
    let gap = |x: f32, _: f32| if x == 20.0 { f32::NAN } else { 0.0 };
    let found = surface(Level::new(), &observed(400.0, |_, _| 0.0, gap), MODEL).unwrap();
    assert!((0..ROWS).all(|y| found.variance.row(y)[PAD + 20] == f32::INFINITY));
    assert!((0..ROWS).all(|y| found.variance.row(y)[PAD + 21].is_finite()));
}

#[test]
fn larger_discs_serve_where_sigma_is_larger_than_wanted() {
    let plane = |_: f32, _: f32| 0.3;
    let observed = observed(4.0, plane, plane);
    let variance = |wanted_variance: f32| {
        let found = surface(Level::new(), &observed, Model { wanted_variance, ..MODEL }).unwrap();
        let error = largest_error(&found, plane, |_, _| true);
        assert!(error < 1e-3, "{error}");
        found.variance.row(ROWS / 2)[PAD + COLUMNS / 2]
    };
    assert!(variance(1e-6) < 0.5 * variance(f32::INFINITY));
}

/// Observations of a surface with independent noise of 0.1 px.
fn noisy(seed: u64, surface: impl Fn(f32, f32) -> f32) -> Observed<'static> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise: Vec<f32> = (0..ROWS * COLUMNS).map(|_| StandardNormal.sample(&mut random)).collect();
    observed(100.0, |x, y| surface(x, y) + 0.1 * noise[y as usize * COLUMNS + x as usize], |_, _| 0.0)
}

#[test]
fn edges_are_expected_where_there_are_some_and_as_high_as_they_are() {
    let learned = |height: f32| {
        // Step edges 14 px apart: one or two cross each large disc.
        let observed = noisy(5, |x, _| if ((x / 14.0) as usize).is_multiple_of(2) { height } else { 0.0 });
        priors::learned(Level::new(), &observed, LARGE, &MODEL)
    };
    let share = |edges: EdgePriors| edges.iter().map(|edge| edge.share).sum::<f64>();
    let none = learned(0.0);
    assert!(share(none) < 0.3, "{none:?}");
    let low = learned(0.1);
    let high = learned(0.4);
    // So small a map has some 500 discs; a hundred count for what was expected before.
    assert!(share(low) > 0.6 && share(high) > 0.75, "{low:?} {high:?}");
    // Deviations are those of heights of 0.1 and 0.4 px, as far as they are tried.
    let deviation = |edges: EdgePriors| edges[0].variance.sqrt();
    assert!(deviation(low) < 0.15 && deviation(high) > 0.15, "{low:?} {high:?}");
}
