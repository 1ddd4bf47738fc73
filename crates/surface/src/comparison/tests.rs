//! Comparisons of maps that are known in closed form.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::Geometry;

const SIGMA_MM: f64 = 0.01;

/// 120 x 90 px heights with independent Gaussian noise.
fn heights(seed: u64, surface: impl Fn(f64, f64) -> f64) -> Heights {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = || {
        // Box and Muller (1958).
        let (u, v): (f64, f64) = (1.0 - random.random::<f64>(), random.random());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    };
    let values = (0..10_800)
        .map(|index| (surface((index % 120) as f64, (index / 120) as f64) + SIGMA_MM * noise()) as f32);
    Heights {
        height_mm: Grid::from_values(90, 120, values.collect()).unwrap(),
        sigma_mm: Grid::filled(90, 120, SIGMA_MM as f32),
        distance_mm: 500.0,
        geometry: Geometry::exact(1000.0, 100.0, (59.5, 44.5)),
    }
}

fn bump(x: f64, y: f64) -> f64 {
    0.5 * (-((x - 60.0).powi(2) + (y - 40.0).powi(2)) / 450.0).exp()
}

/// The comparison of maps that are shifted by this, known to `sigma_px`.
fn compared(
    [first, second]: [&Heights; 2],
    ((shift_x, shift_y), sigma_px): ((f64, f64), f64),
    trend: TrendKind,
    inside: Option<&Grid<bool>>,
) -> Result<Comparison, ComparisonError> {
    let place = |x: f64, y: f64| (x + shift_x, y + shift_y);
    compare([first, second], Registration { place: &place, sigma_px }, trend, inside, [(1, 1); 2])
}

const STILL: ((f64, f64), f64) = ((0.0, 0.0), 0.0);

#[test]
fn noise_alone_lies_within_its_sigmas() {
    let found = compared([&heights(1, bump), &heights(2, bump)], STILL, TrendKind::Plane, None).unwrap();
    let numbers = found.statistics;
    assert_eq!(numbers.pixels, 10_800);
    // 10800 independent pixels: the shares scatter by 0.0045 and 0.0021; four times that is missed once in 16000.
    assert!((numbers.within_1_sigma - 0.6827).abs() < 0.018, "{numbers:?}");
    assert!((numbers.within_2_sigma - 0.9545).abs() < 0.009, "{numbers:?}");
    // The difference of two has sqrt 2 times the noise; a robust one of 10800 scatters by 1.1 %.
    let expected_mm = SIGMA_MM * std::f64::consts::SQRT_2;
    assert!((numbers.scatter_mm / expected_mm - 1.0).abs() < 0.05, "{numbers:?}");
    assert!((numbers.median_sigma_mm / expected_mm - 1.0).abs() < 1e-3);
    assert!(found.places.is_empty(), "{:?}", found.places);
}

#[test]
fn a_shifted_tilted_and_raised_object_shows_its_change_alone() {
    // Moved by (3.25, -2) px; turned so that it rises by 0.004 mm per px; 2 mm nearer; with a pit of 20 x 10 px.
    let moved = |x: f64, y: f64| {
        let (x, y) = (x - 3.25, y + 2.0);
        let pit = (80.0..100.0).contains(&x) && (60.0..70.0).contains(&y);
        bump(x, y) + 2.0 + 0.004 * x - if pit { 0.2 } else { 0.0 }
    };
    let maps = [&heights(3, bump), &heights(4, moved)];
    let motion = ((3.25, -2.0), 0.01);
    let found = compared(maps, motion, TrendKind::Plane, None).unwrap();
    // Interpolation leaves out the last 4 columns and the first 2 rows.
    assert_eq!(found.statistics.pixels, (120 - 4) * (90 - 2));
    assert!(found.statistics.median_mm.abs() < 0.001, "{:?}", found.statistics);
    let [pit] = found.places[..] else { panic!("{:?}", found.places) };
    // The pit covers pixels 84 to 103 of the second map. Of the first, a quarter of the pixel before lies between them
    // and the level: columns 81 to 99 are 0.2 mm deep, column 100 is 0.15 mm, and column 80 is 0.05 mm, which is 3.5
    // sigma and may count or not.
    let counted = pit.area_px as f64 - 200.0;
    assert!((0.0..=10.0).contains(&counted), "{pit:?}");
    let mean_mm = -(190.0 * 0.2 + 10.0 * 0.15 + counted * 0.05) / pit.area_px as f64;
    let centre_x = (200.0 * 90.5 + counted * 80.0) / pit.area_px as f64;
    // The mean of 200 pixels scatters by 0.001 mm; four times that.
    assert!((pit.mean_mm - mean_mm).abs() < 0.004, "{pit:?}, not {mean_mm}");
    assert!((pit.centre_px.0 - centre_x).abs() < 1e-9 && (pit.centre_px.1 - 64.5).abs() < 0.2, "{pit:?}");
    assert!((pit.area_mm2 - pit.area_px as f64 * 0.25).abs() < 1e-9);
    // A tilt stays where only an offset is removed.
    let offset = compared(maps, motion, TrendKind::Constant, None).unwrap();
    assert!(offset.statistics.scatter_mm > 0.1, "{:?}", offset.statistics);
}

#[test]
fn on_a_slope_the_uncertainty_of_the_registration_counts() {
    let slope = |x: f64, _: f64| 0.3 * x;
    let maps = [&heights(5, slope), &heights(6, slope)];
    let found = compared(maps, ((0.0, 0.0), 0.1), TrendKind::Constant, None).unwrap();
    // 0.3 mm per px times 0.1 px, and twice the noise. The slope has noise itself.
    let expected = (0.03_f64.powi(2) + 2.0 * SIGMA_MM * SIGMA_MM).sqrt();
    assert!((found.statistics.median_sigma_mm / expected - 1.0).abs() < 0.05, "{:?}", found.statistics);
}

#[test]
fn answers_beside_the_object_do_not_count() {
    // Columns from 105 on are known eleven times worse, in both maps, and differ by 5 mm; before them is a gap.
    let with_strays = |seed: u64, far_mm: f64| {
        let mut map = heights(seed, |x, y| bump(x, y) + if x >= 105.0 { far_mm } else { 0.0 });
        (0..90).for_each(|y| map.height_mm.row_mut(y)[100..105].fill(f32::NAN));
        (0..90).for_each(|y| map.sigma_mm.row_mut(y)[105..].fill(11.0 * SIGMA_MM as f32));
        map
    };
    let maps = [&with_strays(9, 0.0), &with_strays(10, 5.0)];
    let found = compared(maps, STILL, TrendKind::Plane, None).unwrap();
    // Column 99 is the rim.
    assert_eq!(found.statistics.pixels, 99 * 90);
    assert!(found.places.is_empty(), "{:?}", found.places);
}

#[test]
fn only_what_is_inside_counts_and_too_little_is_refused() {
    let (first, second) = (heights(7, bump), heights(8, bump));
    let mut inside = Grid::filled(90, 120, false);
    (0..90).for_each(|y| inside.row_mut(y)[..30].fill(true));
    let found = compared([&first, &second], STILL, TrendKind::Plane, Some(&inside)).unwrap();
    assert_eq!(found.statistics.pixels, 30 * 90);
    assert!(found.difference_mm.at(30, 5).is_nan() && found.sigma_mm.at(30, 5).is_nan());
    let refused = compared([&first, &second], ((119.0, 0.0), 0.0), TrendKind::Plane, None).unwrap_err();
    assert_eq!(refused, ComparisonError::NoOverlap { common_px: 90, least_px: 200 });
}
