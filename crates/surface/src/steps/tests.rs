//! Fields whose depth is known, with errors that go together as those of overlapping windows do.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::super::height::Geometry;
use super::*;
use crate::trend::TrendKind;

#[path = "../../../../tests/support/size.rs"]
mod size;

pub(super) const SIDE: usize = 200;
/// Of the window over which errors are averaged, so that pixels closer than this share a part of them.
const WINDOW: usize = 5;

/// A field of 0.25 mm per px; `height_mm` of X and Y in mm and of column and row, with errors of standard
/// deviation `sigma_mm`.
pub(super) fn field(sigma_mm: f64, seed: u64, height_mm: impl Fn(f64, f64, usize, usize) -> f64) -> Heights {
    let wide = SIDE + WINDOW - 1;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let white: Vec<f64> = (0..wide * wide).map(|_| StandardNormal.sample(&mut random)).collect();
    // The sum of n independent errors is the root of n as large as one.
    let sums = |values: &[f64], x: usize, y: usize, step: usize, width: usize| {
        (0..WINDOW).map(|index| values[y * width + x + index * step]).sum::<f64>()
    };
    let across: Vec<f64> =
        (0..wide * SIDE).map(|index| sums(&white, index % SIDE, index / SIDE, 1, wide)).collect();
    let middle = 0.5 * (SIDE - 1) as f64;
    let values = (0..SIDE * SIDE).map(|index| {
        let (x, y) = (index % SIDE, index / SIDE);
        let error = sigma_mm / WINDOW as f64 * sums(&across, x, y, SIDE, SIDE);
        let height = height_mm(0.25 * (x as f64 - middle), 0.25 * (y as f64 - middle), x, y);
        (height + error) as f32
    });
    Heights {
        height_mm: Grid::from_values(SIDE, SIDE, values.collect()).unwrap(),
        sigma_mm: Grid::filled(SIDE, SIDE, sigma_mm as f32),
        // So far away that X and Y do not depend on the height.
        distance_mm: 1e6,
        geometry: Geometry::exact(4e6, 100.0, (middle, middle)),
    }
}

pub(super) fn tilted(x_mm: f64, y_mm: f64) -> f64 {
    0.3 + 0.004 * x_mm - 0.007 * y_mm
}

fn bowed(x_mm: f64, y_mm: f64) -> f64 {
    tilted(x_mm, y_mm) + 2e-4 * x_mm * x_mm - 1e-4 * x_mm * y_mm - 1.5e-4 * y_mm * y_mm
}

pub(super) fn options(trend: TrendKind) -> StepsOptions {
    StepsOptions::for_window(trend, WINDOW)
}

/// Stripes of 20 px, hollow and raised in turn.
fn stripes(x: usize) -> bool {
    x / 20 % 2 == 1
}

fn disc(x: usize, y: usize, centre: (usize, usize), radius: usize) -> bool {
    x.abs_diff(centre.0).pow(2) + y.abs_diff(centre.1).pow(2) <= radius * radius
}

/// Depth less truth over its sigma, and whether the interval holds the truth.
fn judged(depth: &Depth, truth_mm: f64) -> (f64, bool) {
    let error = depth.depth_mm - truth_mm;
    (error / depth.sigma_mm.unwrap(), error.abs() <= depth.half_width_95_mm.unwrap())
}

/// Fields of which statistics are made; 120 in full size.
fn fields() -> u64 {
    size::repetitions(120) as u64
}

/// The spread of normalised errors is 1, and the interval holds the truth in 95 % of the fields. By n fields a spread is
/// known to 1 / sqrt(2 n), and a share p to sqrt(p (1 - p) / n); three and two of these are allowed. So only the full
/// number notices intervals that are too wide.
fn assert_honest(name: &str, results: &[(f64, bool)]) {
    let count = results.len() as f64;
    let spread_slack = 3.0 / (2.0 * fields() as f64).sqrt();
    let share_slack = 2.0 * (0.95 * 0.05 / fields() as f64).sqrt();
    let spread = (results.iter().map(|(error, _)| error * error).sum::<f64>() / count).sqrt();
    let held = results.iter().filter(|(_, held)| *held).count() as f64 / count;
    assert!((spread - 1.0).abs() < spread_slack, "{name}: spread {spread:.3}, held {held:.3}");
    assert!((held - 0.95).abs() < share_slack, "{name}: held {held:.3}, spread {spread:.3}");
}

#[test]
fn the_interval_of_stripes_holds_as_often_as_it_says() {
    let (mut all, mut each) = (Vec::new(), Vec::new());
    for seed in 0..fields() {
        let heights =
            field(0.03, seed, |x_mm, y_mm, x, _| bowed(x_mm, y_mm) - if stripes(x) { 0.2 } else { 0.0 });
        let found = find_steps(&heights, None, &options(TrendKind::Quadric)).unwrap();
        assert_eq!((found.parts.len(), found.raised), (5, false));
        all.push(judged(&found.depth, 0.2));
        each.extend(found.parts.iter().map(|part| judged(&part.depth, 0.2)));
    }
    assert_honest("all stripes", &all);
    assert_honest("each stripe", &each);
}

#[test]
fn the_interval_of_shallow_pits_holds_as_often_as_it_says() {
    let pit = |x, y| [(50, 50), (150, 60), (100, 140)].iter().any(|&centre| disc(x, y, centre, 22));
    let (mut all, mut each) = (Vec::new(), Vec::new());
    for seed in 0..fields() {
        let heights = field(0.015, 1000 + seed, |x_mm, y_mm, x, y| {
            tilted(x_mm, y_mm) - if pit(x, y) { 0.05 } else { 0.0 }
        });
        let found = find_steps(&heights, None, &options(TrendKind::Plane)).unwrap();
        assert_eq!((found.parts.len(), found.raised), (3, false), "seed {seed}");
        all.push(judged(&found.depth, 0.05));
        each.extend(found.parts.iter().map(|part| judged(&part.depth, 0.05)));
    }
    assert_honest("all pits", &all);
    assert_honest("each pit", &each);
}

/// Hollows in the middle and at both sides, more than half of the field, under a bow of several depths: a quadric
/// through all heights follows them, and two levels about it are others.
#[test]
fn a_form_that_follows_the_hollows_does_not_hide_them() {
    let hollow = |x: usize| x < 37 || (82..119).contains(&x) || x >= 163;
    for (seed, bow) in (0..6).flat_map(|seed| [1.0, 4.0, -4.0].map(|bow| (seed, bow))) {
        let heights = field(0.03, 300 + seed, |x_mm, y_mm, x, _| {
            bow * bowed(x_mm, y_mm) - if hollow(x) { 0.2 } else { 0.0 }
        });
        let found = assert_finds("three hollows", &heights, TrendKind::Quadric, 0.2);
        assert_eq!((found.parts.len(), found.raised), (3, false), "seed {seed}, bow {bow}");
    }
}

/// The depth found, with an error of at most four of its own sigma.
fn assert_finds(name: &str, heights: &Heights, trend: TrendKind, truth_mm: f64) -> Steps {
    let found = find_steps(heights, None, &options(trend)).unwrap_or_else(|error| panic!("{name}: {error}"));
    let (error, _) = judged(&found.depth, truth_mm);
    assert!(error.abs() < 4.0, "{name}: {:?}", found.depth);
    assert!(found.depth.sigma_mm.unwrap() < 0.05 * truth_mm, "{name}: {:?}", found.depth);
    found
}

#[test]
fn hollows_of_all_shapes_are_found() {
    type Shape = fn(usize, usize) -> bool;
    let shapes: [(&str, Shape); 5] = [
        ("along y", |x, _| stripes(x)),
        ("along x", |_, y| stripes(y)),
        ("oblique", |x, y| (2 * x + y) / 45 % 2 == 1),
        ("one round pit", |x, y| disc(x, y, (120, 70), 30)),
        ("one large hollow at the border", |x, y| x < 110 && y > 70),
    ];
    for (name, shape) in shapes {
        for (trend, form) in [
            (TrendKind::Plane, tilted as fn(f64, f64) -> f64),
            (TrendKind::Quadric, bowed),
            (TrendKind::Constant, |_, _| 1.0),
        ] {
            let heights =
                field(0.02, 5, |x_mm, y_mm, x, y| form(x_mm, y_mm) - if shape(x, y) { 0.2 } else { 0.0 });
            let found = assert_finds(name, &heights, trend, 0.2);
            // What is not at a wall is on its level: the walls of oblique stripes are steps of pixels, and
            // smoothing moves them by one.
            let wrong = (0..SIDE * SIDE)
                .filter(|index| found.lower.values()[*index] != shape(index % SIDE, index / SIDE));
            assert!(wrong.count() < SIDE * SIDE / 50, "{name}, {trend:?}");
        }
    }
}

#[test]
fn a_single_wall_across_the_field_is_a_step() {
    // A bow and a step of its own can stand in for a wall, but not as well.
    for (name, kind) in [("quadric", TrendKind::Quadric), ("cubic", TrendKind::Cubic)] {
        for share in [0.15, 0.3, 0.5, 0.7] {
            let wall = (share * SIDE as f64) as usize;
            let results: Vec<(f64, bool)> = (0..size::repetitions(8) as u64)
                .map(|seed| {
                    let heights = field(0.02, 700 + seed, |x_mm, y_mm, x, _| {
                        tilted(x_mm, y_mm) - if x < wall { 0.8 } else { 0.0 }
                    });
                    let steps = find_steps(&heights, None, &options(kind)).unwrap();
                    assert!(steps.scatter_mm < 0.03, "{name}, {wall} px: {}", steps.scatter_mm);
                    judged(&steps.depth, 0.8)
                })
                .collect();
            // Five standard deviations, of which one in a million is more.
            assert!(results.iter().all(|(error, _)| error.abs() < 5.0), "{name}, {wall} px: {results:?}");
        }
    }
}

#[test]
fn what_stands_on_the_ground_is_raised() {
    let post = |x, y| disc(x, y, (60, 60), 25) || disc(x, y, (140, 130), 25);
    let heights = field(0.02, 6, |x_mm, y_mm, x, y| tilted(x_mm, y_mm) + if post(x, y) { 0.2 } else { 0.0 });
    let found = assert_finds("posts", &heights, TrendKind::Plane, 0.2);
    assert!(found.raised);
    let centres: Vec<(f64, f64)> =
        found.parts.iter().map(|part| (part.centre_x_px, part.centre_y_px)).collect();
    assert_eq!(centres.len(), 2);
    for ((x, y), truth) in centres.iter().zip([(60.0, 60.0), (140.0, 130.0)]) {
        assert!((x - truth.0).hypot(y - truth.1) < 0.5);
    }
    // pi 25^2 px of 0.0625 mm^2, and the border's pixels either way.
    assert!((found.parts[0].area_mm2 - 122.7).abs() < 6.0, "{:?}", found.parts[0]);
}

#[test]
fn holes_and_wrong_pixels_change_little() {
    let mut heights =
        field(0.02, 7, |x_mm, y_mm, x, _| bowed(x_mm, y_mm) - if stripes(x) { 0.2 } else { 0.0 });
    for index in 0..SIDE * SIDE {
        let (x, y) = (index % SIDE, index / SIDE);
        let value = &mut heights.height_mm.values_mut()[index];
        if index % 7 == 0 || disc(x, y, (30, 160), 15) {
            *value = f32::NAN;
        } else if index % 41 == 0 {
            *value += if index % 2 == 0 { 3.0 } else { -20.0 };
        }
    }
    let found = assert_finds("holes", &heights, TrendKind::Quadric, 0.2);
    // The hole divides one of the five stripes.
    assert_eq!(found.parts.len(), 6);
}

#[test]
fn the_trend_is_that_of_the_upper_level() {
    let heights = field(0.02, 8, |x_mm, y_mm, x, _| bowed(x_mm, y_mm) - if stripes(x) { 0.2 } else { 0.0 });
    let trend = find_steps(&heights, None, &options(TrendKind::Quadric)).unwrap().trend;
    let truth = [0.3, 0.004, -0.007, 2e-4, -1e-4, -1.5e-4];
    for ((found, sigma), truth) in trend.coefficients.iter().zip(&trend.sigmas).zip(truth) {
        assert!((found - truth).abs() < 4.0 * sigma.unwrap(), "{found} {sigma:?} {truth}");
    }
}

#[test]
fn levels_that_are_too_narrow_are_said_to_be_there() {
    // Margin 4, so that a stripe must be 9 px wide.
    for seed in 0..5 {
        let narrow = field(0.02, 300 + seed, |x_mm, y_mm, x, _| {
            tilted(x_mm, y_mm) - if x / 6 % 2 == 1 { 0.2 } else { 0.0 }
        });
        match find_steps(&narrow, None, &options(TrendKind::Plane)) {
            Err(SurfaceError::TooNarrow { margin_px: 4, depth_mm }) => {
                assert!((depth_mm - 0.2).abs() < 0.01, "{depth_mm}");
            }
            found => panic!("seed {seed}: {:?}", found.map(|found| found.depth)),
        }
    }
}

#[test]
fn one_level_is_refused() {
    for seed in 0..15 {
        for trend in [TrendKind::Plane, TrendKind::Quadric] {
            let flat = field(0.02, 100 + seed, |x_mm, y_mm, _, _| tilted(x_mm, y_mm));
            let found = find_steps(&flat, None, &options(trend));
            assert!(
                matches!(found, Err(SurfaceError::OneLevel { .. })),
                "seed {seed}: {:?}",
                found.map(|found| found.depth)
            );
        }
    }
    // A bow that the plane leaves is no level either.
    let bow = field(0.001, 200, |x_mm, y_mm, _, _| 4e-4 * (x_mm * x_mm + y_mm * y_mm));
    let found = find_steps(&bow, None, &options(TrendKind::Plane));
    assert!(matches!(found, Err(SurfaceError::NoValley { .. })), "{:?}", found.map(|found| found.depth));
}

#[test]
fn fields_without_heights_are_refused() {
    let mut heights = field(0.02, 9, |_, _, _, _| 0.0);
    heights.height_mm.values_mut().fill(f32::NAN);
    let found = find_steps(&heights, None, &options(TrendKind::Plane));
    assert_eq!(found.unwrap_err(), SurfaceError::TooFewPixels { pixels: 0, what: "a plane" });
}

#[test]
fn the_grown_margin_is_kept_where_hollows_have_the_room() {
    let grown = options(TrendKind::Plane).with_grown_window(11);
    assert_eq!((grown.margin_px, grown.grown_margin_px), (4, 6));
    for (width, margin_px) in [(20, 6), (12, 4)] {
        // 20 px leave 12 and 8 px clear of the walls, more than a quarter; 12 px leave 4 and none.
        let heights = field(0.01, 7, |x_mm, y_mm, x, _| {
            tilted(x_mm, y_mm) - if x / width % 2 == 1 { 0.2 } else { 0.0 }
        });
        let found = find_steps(&heights, None, &grown).unwrap();
        assert_eq!(found.margin_px, margin_px, "{width} px");
        // Seven of its standard deviations of some 0.0005 mm.
        assert!((found.depth.depth_mm - 0.2).abs() < 0.004, "{width} px: {}", found.depth.depth_mm);
    }
}

/// A half that is divided and measured by the same heights.
fn alike(heights: Heights) -> HalfHeights {
    HalfHeights { dividing: heights.clone(), measured: heights, locking_mm: None }
}

/// Stripes three times as deep as a half scatters, measured by halves whose sigmas are `sigma_mm` of the height over
/// the middle between the levels; judged with many seeds.
fn judged_by_halves(sigma_mm: impl Fn(f64) -> f64) -> Vec<(f64, bool)> {
    let (depth_mm, middle) = (0.12, 0.5 * (SIDE - 1) as f64);
    let form = |x_mm: f64, y_mm: f64, x: usize, _: usize| {
        tilted(x_mm, y_mm) - if stripes(x) { depth_mm } else { 0.0 }
    };
    let half = |seed| {
        let mut heights = field(0.04, seed, form);
        let sigmas = heights.sigma_mm.values_mut().iter_mut().zip(heights.height_mm.values()).enumerate();
        for (index, (sigma, &height_mm)) in sigmas {
            let place = |pixels: usize| 0.25 * (pixels as f64 - middle);
            let middle_mm = tilted(place(index % SIDE), place(index / SIDE)) - 0.5 * depth_mm;
            *sigma = sigma_mm(f64::from(height_mm) - middle_mm) as f32;
        }
        alike(heights)
    };
    let judge = |seed: u64| {
        let halves = [0, 1].map(|index| half(2 * seed + index));
        let mut whole = halves[0].measured.clone();
        let others = halves[1].measured.height_mm.values();
        for (height, other) in whole.height_mm.values_mut().iter_mut().zip(others) {
            *height = 0.5 * (*height + other);
        }
        let found = find_steps(&whole, Some(&halves), &options(TrendKind::Plane)).unwrap();
        assert_eq!(found.parts.len(), 5, "seed {seed}");
        judged(&found.depth, depth_mm)
    };
    (0..fields()).map(judge).collect()
}

/// The mean of n normalised errors is known to 1 / sqrt(n); three of these.
fn assert_unbiased(results: &[(f64, bool)]) {
    let count = results.len() as f64;
    let mean = results.iter().map(|(error, _)| error).sum::<f64>() / count;
    assert!(mean.abs() < 3.0 / count.sqrt(), "{mean}");
}

#[test]
fn levels_that_another_half_shows_do_not_make_the_depth_larger() {
    let crossed = judged_by_halves(|_| 0.04);
    assert_honest("by halves", &crossed);
    assert_unbiased(&crossed);
}

#[test]
fn sigmas_that_know_the_error_of_their_height_do_not_weigh_it() {
    // Heights that noise has put near the other level have the smaller sigmas.
    let crossed = judged_by_halves(|over_middle_mm| 0.036 + 0.06 * over_middle_mm.abs());
    assert_honest("by halves", &crossed);
    assert_unbiased(&crossed);
}

#[test]
fn a_half_that_shows_one_level_is_refused() {
    let form =
        |x_mm: f64, y_mm: f64, x: usize, _: usize| tilted(x_mm, y_mm) - if stripes(x) { 0.2 } else { 0.0 };
    let flat = field(0.03, 2, |x_mm, y_mm, _, _| tilted(x_mm, y_mm));
    let halves = [field(0.03, 1, form), flat].map(alike);
    let found = find_steps(&field(0.03, 3, form), Some(&halves), &options(TrendKind::Plane));
    assert!(matches!(found, Err(SurfaceError::OneLevel { .. })), "{:?}", found.map(|found| found.depth));
}

#[test]
fn windows_that_see_far_divide_but_do_not_measure() {
    // Heights that divide are means over 17 columns, which reach beyond the grown margin.
    let form =
        |x_mm: f64, y_mm: f64, x: usize, _: usize| tilted(x_mm, y_mm) - if stripes(x) { 0.2 } else { 0.0 };
    let halves = [1, 2].map(|seed| {
        let exact = field(0.0, seed, form);
        let mut dividing = field(0.01, seed, form);
        for y in 0..exact.height_mm.rows() {
            let row = exact.height_mm.row(y);
            for (x, height) in dividing.height_mm.row_mut(y).iter_mut().enumerate() {
                let around = &row[x.saturating_sub(8)..(x + 9).min(row.len())];
                *height += around.iter().sum::<f32>() / around.len() as f32 - row[x];
            }
        }
        HalfHeights { dividing, measured: field(0.01, seed + 10, form), locking_mm: None }
    });
    let options = options(TrendKind::Plane).with_grown_window(11);
    let wide = find_steps(&halves[0].dividing, None, &options).unwrap().depth;
    assert!(wide.depth_mm < 0.99 * 0.2, "{wide:?}");
    let found = find_steps(&halves[0].dividing, Some(&halves), &options).unwrap();
    // The division was smoothed by 4 px to each side. Of 20 columns, a margin of 4 px then leaves 4, and one of 5 px the
    // last that is half of them.
    assert_eq!(found.margin_px, 5);
    let Depth { depth_mm, half_width_95_mm, .. } = found.depth;
    let holds = |depth_mm: f64| (depth_mm - 0.2).abs() < half_width_95_mm.unwrap();
    assert!(holds(depth_mm) && !holds(wide.depth_mm), "{:?}, {wide:?}", found.depth);
}

#[test]
fn what_pixel_locking_does_to_the_depth_is_counted() {
    let form =
        |x_mm: f64, y_mm: f64, x: usize, _: usize| tilted(x_mm, y_mm) - if stripes(x) { 0.2 } else { 0.0 };
    let mut halves = [1, 2].map(|seed| alike(field(0.01, seed, form)));
    let contribution = |halves: &[HalfHeights; 2]| {
        let steps = find_steps(&halves[0].measured, Some(halves), &options(TrendKind::Plane)).unwrap();
        steps.budget.contributions.iter().find(|part| part.name.starts_with("pixel")).unwrap().sigma_mm
    };
    assert_eq!(contribution(&halves), Some(0.0));
    // Hollows of one half look 0.01 mm too deep, and what is common to all pixels is no depth.
    let errors = (0..SIDE * SIDE).map(|index| if stripes(index % SIDE) { 0.29 } else { 0.3 });
    halves[1].locking_mm = Some(Grid::from_values(SIDE, SIDE, errors.collect()).unwrap());
    let found = contribution(&halves).unwrap();
    // Both halves count alike, to the chance of which of their pixels are outliers.
    assert!((found - 0.005).abs() < 1e-4, "{found}");
}

#[test]
fn plateaus_tell_of_walls_that_are_wider_than_the_margin() {
    // A groove 60 px wide at its bottom, whose walls are 30 px wide.
    let inside = |x: usize| (1.0 - (x.abs_diff(SIDE / 2) as f64 - 30.0) / 30.0).clamp(0.0, 1.0);
    for seed in 0..5 {
        let halves = [1, 2].map(|half| {
            alike(field(0.01, 2 * seed + half, |x_mm, y_mm, x, _| tilted(x_mm, y_mm) - 0.2 * inside(x)))
        });
        let steps = find_steps(&halves[0].measured, Some(&halves), &options(TrendKind::Plane)).unwrap();
        let off = (steps.depth.depth_mm - 0.2).abs();
        assert!(off > steps.depth.half_width_95_mm.unwrap(), "{:?}", steps.depth);
        assert!(off <= steps.budget.combined.unwrap().half_width_95_mm, "{:?}", steps.budget);
    }
}
