use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::pools::POOL_REACH;
use super::*;

const ROWS: usize = 200;
const COLUMNS: usize = 240;
/// Windows of three pixels.
const SIDE: usize = 3;
const SMALL_SIGMA: f32 = 0.01;

/// A surface without noise that lies `lift(x)` beside small windows whose noise is that of means over 3 x 3
/// px.
fn surfaces(
    (rows, columns): (usize, usize),
    random: &mut ChaCha8Rng,
    lift: impl Fn(usize) -> f32,
) -> (SurfacePlanes, SurfacePlanes) {
    let stride = columns + 2;
    let white: Vec<f32> = (0..(rows + 2) * stride).map(|_| StandardNormal.sample(random)).collect();
    let mut surface = SurfacePlanes::unknown(rows, columns);
    let mut small = SurfacePlanes::unknown(rows, columns);
    for y in 0..rows {
        surface.variance.row_mut(y)[PAD..PAD + columns].fill(0.0);
        small.variance.row_mut(y)[PAD..PAD + columns].fill(SMALL_SIGMA * SMALL_SIGMA);
        for x in 0..columns {
            let window = (0..SIDE).flat_map(|v| &white[(y + v) * stride + x..][..SIDE]);
            // The sum of nine has the sigma 3.
            small.disparity.row_mut(y)[PAD + x] = 7.0 + SMALL_SIGMA / 3.0 * window.sum::<f32>();
            surface.disparity.row_mut(y)[PAD + x] = 7.0 + lift(x);
        }
    }
    (surface, small)
}

fn missed(lift: impl Fn(usize) -> f32) -> Padded {
    let (surface, small) = surfaces((ROWS, COLUMNS), &mut ChaCha8Rng::seed_from_u64(3), lift);
    missed_by_small(&surface, (&small, SIDE), LEAST_SPARE)
}

fn at(padded: &Padded, (x, y): (usize, usize)) -> f32 {
    padded.row(y)[PAD + x]
}

#[test]
fn noise_alone_is_seldom_significant() {
    // One square each: as large as pools reach to one side.
    let side = POOL_REACH + 1;
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let told = (0..1000).filter(|_| {
        let (surface, small) = surfaces((side, side), &mut random, |_| 0.0);
        !at(&missed_by_small(&surface, (&small, SIDE), LEAST_SPARE), (7, 7)).is_nan()
    });
    // Gaussians stand out by 2.5 once in 160. Windows share observations, so that few hundred are
    // independent: squares of so few are skew (third moment 2.8 / sqrt(190)), which makes it once in 100.
    // Four standard deviations more.
    let told = told.count();
    assert!(told < 10 + 13, "{told}");
}

#[test]
fn what_a_band_smooths_away_is_stated_in_the_band() {
    let band = 120..132;
    let found = missed(|x| if band.contains(&x) { 0.05 } else { 0.0 });
    let mean = |columns: std::ops::Range<usize>| {
        let values = (POOL_REACH..ROWS - POOL_REACH).flat_map(|y| columns.clone().map(move |x| (x, y)));
        let values: Vec<f32> = values.map(|place| at(&found, place)).collect();
        values.iter().sum::<f32>() / values.len() as f32
    };
    // A column's mean over 81 rows of (0.05 + noise)^2 - 0.01^2: noise of 0.01, of which three neighbours
    // share a window, makes 0.001 sqrt(3 / 81) of it; four times that for a mean over bands that are four
    // windows wide.
    let expected = 0.0025;
    assert!((mean(band.clone()) - expected).abs() < 4.0 * 0.001 * (3.0_f32 / 81.0).sqrt() / 2.0);
    // Beside it columns show the small windows' noise alone, 0.01^2 sqrt(2 * 3 / 81) = 0.000027, of which the
    // half that is less than 0 counts as 0.
    for near in [band.start - POOL_REACH / 2..band.start - 1, band.end + 1..band.end + POOL_REACH / 2] {
        assert!(mean(near) < 0.000027);
    }
    // Out of reach nothing is told but by chance.
    for y in 0..ROWS {
        assert!(at(&found, (band.start - POOL_REACH - 1, y)).max(0.0) < 0.0001, "{y}");
    }
}

#[test]
fn what_no_line_shows_is_told_by_the_square() {
    // In a line a mean has the standard deviation 0.000027, see above, in a square a fifth of it: 0.0000052.
    let lift = 0.0045_f32;
    let found = missed(|_| lift);
    for place in [(100, 100), (POOL_REACH, POOL_REACH), (COLUMNS - POOL_REACH - 1, 120)] {
        let found = at(&found, place);
        assert!((found - lift * lift).abs() < 4.0 * 0.0000052, "{place:?}: {found}");
    }
}

#[test]
fn unknown_pixels_and_other_surfaces_tell_nothing() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let (surface, mut small) = surfaces((ROWS, COLUMNS), &mut random, |_| 0.05);
    (0..ROWS).for_each(|y| small.disparity.row_mut(y).iter_mut().for_each(|value| *value += 0.6));
    assert!(at(&missed_by_small(&surface, (&small, SIDE), LEAST_SPARE), (100, 100)).is_nan());
    let (surface, mut small) = surfaces((ROWS, COLUMNS), &mut random, |_| 0.05);
    (0..ROWS).for_each(|y| small.variance.row_mut(y).fill(f32::INFINITY));
    assert!(at(&missed_by_small(&surface, (&small, SIDE), LEAST_SPARE), (100, 100)).is_nan());
}

#[test]
fn the_lesser_of_two_tells() {
    let lesser = |first: f32, second: f32| {
        let [first, second] = [first, second].map(|value| Padded::filled(1, 1, value));
        at(&common_variance(first, &second), (0, 0))
    };
    assert_eq!(lesser(0.2, 0.1), 0.1);
    assert_eq!(lesser(0.1, 0.2), 0.1);
    assert_eq!(lesser(f32::NAN, 0.2), 0.2);
    assert_eq!(lesser(0.2, f32::NAN), 0.2);
    assert_eq!(lesser(f32::NAN, f32::NAN), 0.0);
}

/// A surface `disparity(x, y)` whose variance is 1e-6, and a map with the same slants whose windows disagree
/// by `apart(x, y)` variances.
fn chosen(
    disparity: impl Fn(f32, f32) -> f32,
    slants: (f32, f32),
    apart: impl Fn(usize, usize) -> f32,
) -> (SurfacePlanes, SurfacePlanes) {
    let mut surface = SurfacePlanes::unknown(ROWS, COLUMNS);
    for y in 0..ROWS {
        for x in 0..COLUMNS {
            surface.disparity.row_mut(y)[PAD + x] = disparity(x as f32, y as f32);
            surface.texture.row_mut(y)[PAD + x] = 1e-6 * apart(x, y);
        }
        surface.variance.row_mut(y)[PAD..PAD + COLUMNS].fill(1e-6);
        surface.slant_x.row_mut(y).fill(slants.0);
        surface.slant_y.row_mut(y).fill(slants.1);
    }
    (surface.clone(), surface)
}

#[test]
fn windows_that_disagree_as_by_chance_tell_nothing() {
    let (surface, map) = chosen(|_, _| 7.0, (0.0, 0.0), |_, _| APART_BY_CHANCE);
    let smoothed = smoothed_away((&surface, &[]), &map, disagreement(&map));
    assert!((0..ROWS).all(|y| smoothed.row(y)[PAD..PAD + COLUMNS].iter().all(|&value| value == 0.0)));
}

#[test]
fn half_of_what_windows_disagree_by_beyond_chance_is_told() {
    // One pixel's windows are far apart and tell on their own.
    let far = (60, 70);
    let apart = |x, y| APART_BY_CHANCE + if (x, y) == far { 30.0 } else { 4.0 };
    let (surface, map) = chosen(|_, _| 7.0, (0.0, 0.0), apart);
    let smoothed = smoothed_away((&surface, &[]), &map, disagreement(&map));
    // The one is a ten thousandth of its square, but an eightieth of its lines.
    for (place, expected) in [((150, 150), 2e-6), (far, 18e-6)] {
        assert!((at(&smoothed, place) / expected - 1.0).abs() < 1e-3, "{place:?}");
    }
}

#[test]
fn steps_are_uncertain_by_where_they_lie() {
    let expected = 0.06 * 0.06 / 12.0;
    // On a slanted plane, across rows and across columns; a pixel from the step sees all of it, two away
    // nothing.
    let plane = |x: f32, y: f32| 7.0 + 0.02 * x - 0.03 * y;
    let stepped = |x: f32, y: f32| plane(x, y) + if x >= 100.0 { 0.06 } else { 0.0 };
    let across_columns = |x: f32, y: f32| plane(x, y) + if y >= 100.0 { 0.06 } else { 0.0 };
    let found = |disparity: &dyn Fn(f32, f32) -> f32, place| {
        let (surface, map) = chosen(disparity, (0.02, -0.03), |_, _| 0.0);
        at(&smoothed_away((&surface, &[]), &map, disagreement(&map)), place)
    };
    for (near, far) in [(99, 98), (100, 101)] {
        assert!((found(&stepped, (near, 50)) / expected - 1.0).abs() < 1e-3);
        assert!((found(&across_columns, (50, near)) / expected - 1.0).abs() < 1e-3);
        assert_eq!(found(&stepped, (far, 50)), 0.0);
        assert_eq!(found(&across_columns, (50, far)), 0.0);
    }
    // Beside creases that the faces tell, none is counted.
    let (surface, map) = chosen(stepped, (0.02, -0.03), |_, _| 0.0);
    let mut creases = vec![Vec::new(); ROWS];
    creases[50].push(PAD + 99);
    let smoothed = smoothed_away((&surface, &creases), &map, disagreement(&map));
    assert_eq!(at(&smoothed, (99, 50)), 0.0);
    assert!(at(&smoothed, (99, 51)) > 0.0 && at(&smoothed, (100, 50)) > 0.0);
    // At the borders nothing is known beyond.
    for place in [(0, 0), (COLUMNS - 1, ROWS - 1), (0, 100), (100, ROWS - 1)] {
        assert_eq!(found(&plane, place), 0.0);
    }
}

#[test]
fn slants_noise_and_edges_of_things_are_no_steps() {
    let noise = 0.0001;
    assert_eq!(step(0.06, noise, [0.0, 0.0]), 0.06 * 0.06 / 12.0);
    // A ridge: the slant of one of its sides explains it.
    assert_eq!(step(0.06, noise, [0.03, -0.03]), 0.0);
    assert_eq!(step(0.06, noise, [-0.03, 0.03]), 0.0);
    assert_eq!(step(0.019, noise, [0.0, 0.0]), 0.0);
    assert_eq!(step(1.1, noise, [0.0, 0.0]), 0.0);
    assert_eq!(step(0.5, f32::INFINITY, [0.0, 0.0]), 0.0);
}
