use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::*;

/// The limits that these tests are made with.
const BELONGS_SIGMAS: f32 = 3.3;
const SLANT_SPREAD: f32 = 12.0;
const RULE: SupportRule = SupportRule {
    reach: (1, 1),
    belongs_sigmas: BELONGS_SIGMAS,
    slant_spread: SLANT_SPREAD,
    slack: (0.0, 0.0),
    slants_known: false,
};

const ROWS: usize = 24;
const COLUMNS: usize = 40;
/// Variance of the noise, in DN^2.
const NOISE: f64 = 1.5;

/// Observations for `disparity` with the weight `weight` of each pixel.
fn observations_for(
    disparity: impl Fn(usize, usize) -> f64,
    weight: impl Fn(usize, usize) -> f64,
) -> ObservationMaps {
    let mut observations = ObservationMaps::empty(ROWS, COLUMNS);
    observations.noise = Padded::filled(ROWS, COLUMNS, NOISE as f32);
    for y in 0..ROWS {
        for x in 0..COLUMNS {
            observations.weight.row_mut(y)[PAD + x] = weight(x, y) as f32;
            observations.inverse.row_mut(y)[PAD + x] = (1.0 / weight(x, y)) as f32;
            observations.moment.row_mut(y)[PAD + x] = (weight(x, y) * disparity(x, y)) as f32;
        }
    }
    observations
}

/// Planes `disparity` with the slants `p` and `q`, known with `variance`.
fn map_of(disparity: impl Fn(usize, usize) -> f64, (p, q): (f64, f64), variance: f64) -> SurfacePlanes {
    let mut map = SurfacePlanes::unknown(ROWS, COLUMNS);
    for y in 0..ROWS {
        for x in 0..COLUMNS {
            map.disparity.row_mut(y)[PAD + x] = disparity(x, y) as f32;
            map.slant_x.row_mut(y)[PAD + x] = p as f32;
            map.slant_y.row_mut(y)[PAD + x] = q as f32;
            map.variance.row_mut(y)[PAD + x] = variance as f32;
        }
    }
    map
}

fn joined(observations: &ObservationMaps, map: &SurfacePlanes, rule: SupportRule) -> SurfacePlanes {
    let mut planes = SurfacePlanes::unknown(ROWS, COLUMNS);
    planes
        .par_rows()
        .enumerate()
        .for_each(|(y, out)| join_row(Level::new(), (observations, map), rule, y, None, out));
    planes
}

/// Weights from 500 to 1500 without order.
fn uneven(x: usize, y: usize) -> f64 {
    500.0 + ((x * x * 31 + y * y * 57 + x * y * 13) % 1000) as f64
}

/// Columns and rows within `reach` of a pixel, in the image.
fn window((x, y): (usize, usize), (reach_u, reach_v): (usize, usize)) -> Vec<(usize, usize)> {
    let columns = x.saturating_sub(reach_u)..(x + reach_u + 1).min(COLUMNS);
    let rows = y.saturating_sub(reach_v)..(y + reach_v + 1).min(ROWS);
    rows.flat_map(|row| columns.clone().map(move |column| (column, row))).collect()
}

const P: f64 = 0.03;
const Q: f64 = -0.02;

fn slanted(x: usize, y: usize) -> f64 {
    2.5 + P * x as f64 + Q * y as f64
}

#[test]
fn equal_observations_on_a_plane_give_it_with_the_variance_of_their_mean() {
    let weight = 800.0;
    let observations = observations_for(slanted, |_, _| weight);
    let map = map_of(slanted, (P, Q), 1e-4);
    for reach in [(1, 1), (3, 3), (3, 8), (10, 10)] {
        let surface = joined(&observations, &map, SupportRule { reach, ..RULE });
        let count = ((2 * reach.0 + 1) * (2 * reach.1 + 1)) as f64;
        let (x, y) = (20, 12);
        let at = |plane: &Padded| f64::from(plane.row(y)[PAD + x]);
        assert!((at(&surface.disparity) - slanted(x, y)).abs() < 1e-5);
        let variance = NOISE / (count * weight);
        assert!((at(&surface.variance) / variance - 1.0).abs() < 1e-4, "{reach:?}");
        assert!((at(&surface.texture) / (weight / NOISE) - 1.0).abs() < 1e-4);
        // The slant of zero that is observed beside, with a sigma of 0.1 px/px, draws by its share.
        let share = |reach: usize| {
            let squares = (reach * (reach + 1)) as f64 / 3.0 * count * weight;
            squares / (squares + 100.0 * NOISE)
        };
        let slant_variance =
            |reach: usize| share(reach) * NOISE * 3.0 / ((reach * (reach + 1)) as f64 * count * weight);
        let of_both = slant_variance(reach.0) + slant_variance(reach.1);
        assert!((at(&surface.slant_variance) / of_both - 1.0).abs() < 1e-4, "{reach:?}");
        assert!((at(&surface.slant_x) - P * share(reach.0)).abs() < 1e-5, "{reach:?}");
        assert!((at(&surface.slant_y) - Q * share(reach.1)).abs() < 1e-5, "{reach:?}");
    }
}

#[test]
fn the_other_face_of_a_crease_does_not_belong_by_its_slant() {
    const FACE: f64 = 0.15;
    const RIGHT: usize = 21;
    let crease = RIGHT as f64 - 0.5;
    let roof = |x: usize, _: usize| 4.0 - FACE * (x as f64 - crease).abs();
    // So much that the disparities across the crease, 0.15 px off, are allowed for, but not the slants, which
    // a difference of 0.24 px in windows of three px would tell.
    let variance = 0.04 / f64::from(2.0 * BELONGS_SIGMAS * BELONGS_SIGMAS);
    let mut map = map_of(roof, (FACE, 0.0), variance);
    for y in 0..ROWS {
        map.slant_x.row_mut(y)[PAD + RIGHT..].fill(-FACE as f32);
    }
    let observations = observations_for(roof, |_, _| 8e6);
    let error = |slants_known| {
        let surface = joined(&observations, &map, SupportRule { slants_known, ..RULE });
        (f64::from(surface.disparity.row(12)[PAD + RIGHT - 1]) - roof(RIGHT - 1, 12)).abs()
    };
    assert!(error(true) < 1e-4, "{}", error(true));
    // The mean of three columns, of which one is 0.15 px lower than the face goes on.
    assert!(error(false) > 0.02, "{}", error(false));
}

#[test]
fn the_plane_solves_the_normal_equations() {
    // A shallow bowl, so that the observations lie on no plane; within what is allowed for.
    let bowl = |x: usize, y: usize| {
        slanted(x, y) + 0.0004 * ((x as f64 - 20.0).powi(2) + 0.7 * (y as f64 - 12.0).powi(2))
    };
    let observations = observations_for(bowl, uneven);
    let variance = 1e-3;
    let map = map_of(bowl, (P, Q), variance);
    let reach = (4, 2);
    for slants_known in [false, true] {
        let rule = SupportRule { reach, slants_known, ..RULE };
        let surface = joined(&observations, &map, rule);
        // The map's slants are observations, too, as good as those of windows 3 px wide.
        let known = if slants_known { NOISE * (2.0 / 3.0) / variance } else { 0.0 };
        for pixel in [(20, 12), (0, 0), (39, 23), (3, 22), (31, 1), (17, 5)] {
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for (column, row) in window(pixel, reach) {
                let u = Vector3::new(1.0, column as f64 - pixel.0 as f64, row as f64 - pixel.1 as f64);
                normal += u * u.transpose() * uneven(column, row);
                right += u * (uneven(column, row) * bowl(column, row));
            }
            normal[(1, 1)] += 100.0 * NOISE + known;
            normal[(2, 2)] += 100.0 * NOISE + known;
            right += Vector3::new(0.0, known * P, known * Q);
            let inverse = normal.try_inverse().unwrap();
            let solution = inverse * right;
            let at = |plane: &Padded| f64::from(plane.row(pixel.1)[PAD + pixel.0]);
            // Moments of some 5000 in single precision lose 0.0005 of observations that weigh 1000.
            assert!((at(&surface.disparity) - solution[0]).abs() < 1e-5, "{pixel:?}");
            assert!((at(&surface.slant_x) - solution[1]).abs() < 1e-5, "{pixel:?}");
            assert!((at(&surface.slant_y) - solution[2]).abs() < 1e-5, "{pixel:?}");
            // Bends may raise the variance, nothing lowers it.
            assert!(at(&surface.variance) > NOISE * inverse[(0, 0)] * (1.0 - 1e-4), "{pixel:?}");
        }
    }
}

#[test]
fn nested_windows_give_what_each_window_gives_by_itself() {
    // Whole numbers, whose sums are exact in whatever order: a step along a diagonal, observations scattered
    // about it, some missing.
    let step = |x: usize, y: usize| if x + y < 30 { 0.0 } else { 100.0 };
    let scattered = |x: usize, y: usize| step(x, y) + ((x * 5 + y * 11 + x * y) % 3) as f64 - 1.0;
    let observations = observations_for(scattered, |x, y| ((x * x + 3 * y) % 9) as f64);
    let map = map_of(step, (0.0, 0.0), 0.5);
    let rule = |reach| SupportRule { reach, slack: (0.5, 0.25), ..RULE };
    for widest in [(3, 10), (10, 3), (3, 5)] {
        let mut found = [(); 3].map(|()| SurfacePlanes::unknown(ROWS, COLUMNS));
        let [narrow, middle, wide] = &mut found;
        let rows = narrow.par_rows().zip(middle.par_rows()).zip(wide.par_rows());
        rows.enumerate().for_each(|(y, ((narrow, middle), wide))| {
            join_nested_row(Level::new(), (&observations, &map), rule(widest), y, [narrow, middle, wide]);
        });
        for (found, reach) in found.iter().zip(nested_reaches(widest)) {
            let single = joined(&observations, &map, rule(reach));
            let planes = |of: &SurfacePlanes, y: usize| {
                let fit = [&of.misfit, &of.texture, &of.slant_variance];
                [&of.disparity, &of.slant_x, &of.slant_y, &of.variance]
                    .into_iter()
                    .chain(fit)
                    .map(|plane| plane.row(y)[PAD..PAD + COLUMNS].to_vec())
                    .collect::<Vec<_>>()
            };
            for y in 0..ROWS {
                assert_eq!(planes(found, y), planes(&single, y), "{reach:?}, row {y}");
            }
        }
    }
    assert_eq!(nested_reaches((3, 10)), [(1, 10), (2, 10), (3, 10)]);
    assert_eq!(nested_reaches((10, 3)), [(10, 1), (10, 2), (10, 3)]);
}

/// Column at which the steps of the tests are.
const EDGE: usize = 20;

#[test]
fn a_step_twice_as_high_as_allowed_for_is_not_crossed() {
    let (reach, variance, weight) = (3, 1e-4, 800.0);
    // What the farthest neighbour, 3 px away along both axes, is allowed to differ by.
    let allowed = f64::from(BELONGS_SIGMAS) * (variance * (2.0 + 18.0 / f64::from(SLANT_SPREAD))).sqrt();
    let step = |x: usize, _| if x < EDGE { 0.0 } else { 2.0 * allowed };
    let observations = observations_for(step, |_, _| weight);
    let map = map_of(step, (0.0, 0.0), variance);
    let surface = joined(&observations, &map, SupportRule { reach: (reach, reach), ..RULE });
    let y = 12;
    for x in reach..COLUMNS - reach {
        let at = |plane: &Padded| f64::from(plane.row(y)[PAD + x]);
        assert!((at(&surface.disparity) - step(x, y)).abs() < 1e-6, "column {x}");
        // The window's own side: columns reach from -3 to 3, or to where the step is.
        let side: Vec<f64> = (x - reach..=x + reach)
            .filter(|&column| (column < EDGE) == (x < EDGE))
            .map(|column| column as f64 - x as f64)
            .collect();
        let sum = |power: i32| 7.0 * weight * side.iter().map(|u| u.powi(power)).sum::<f64>();
        let variance = NOISE / (sum(0) - sum(1) * sum(1) / (sum(2) + 100.0 * NOISE));
        assert!((at(&surface.variance) / variance - 1.0).abs() < 1e-3, "column {x}");
    }
}

#[test]
fn a_step_that_is_allowed_for_is_crossed() {
    let variance: f64 = 1e-4;
    // Neighbours in the same place may differ by 3.3 times the root of two variances.
    let low = 0.5 * f64::from(BELONGS_SIGMAS) * (2.0 * variance).sqrt();
    let step = |x: usize, _| if x < EDGE { 0.0 } else { low };
    let (observations, map) = (observations_for(step, |_, _| 800.0), map_of(step, (0.0, 0.0), variance));
    let surface = joined(&observations, &map, RULE);
    // Columns -1, 0, 1 observation 0, 0 and `low`: their mean is what a line gives in the middle.
    let found = f64::from(surface.disparity.row(12)[PAD + EDGE - 1]);
    assert!((found - low / 3.0).abs() < 1e-5, "{found}");
    // The same step beyond what is allowed for, but with slack.
    let high = |x: usize, _| if x < EDGE { 0.0 } else { 4.0 * low };
    let (observations, map) = (observations_for(high, |_, _| 800.0), map_of(high, (0.0, 0.0), variance));
    let without = joined(&observations, &map, RULE);
    assert!(without.disparity.row(12)[PAD + EDGE - 1].abs() < 1e-6);
    let with =
        joined(&observations, &map, SupportRule { slack: (3.0 * low as f32, 3.0 * low as f32), ..RULE });
    assert!((f64::from(with.disparity.row(12)[PAD + EDGE - 1]) - 4.0 * low / 3.0).abs() < 1e-5);
}

#[test]
fn of_observations_at_the_limit_half_counts() {
    let (variance, weight): (f64, f64) = (1e-4, 800.0);
    // A neighbour one column away may differ by this much.
    let allowed = f64::from(BELONGS_SIGMAS) * (variance * (2.0 + 1.0 / f64::from(SLANT_SPREAD))).sqrt();
    let found = |step: f64| {
        let step = |x: usize, _| if x < EDGE { 0.0 } else { step };
        let (observations, map) = (observations_for(step, |_, _| weight), map_of(step, (0.0, 0.0), variance));
        let rule = SupportRule { reach: (1, 0), ..RULE };
        let surface = joined(&observations, &map, rule);
        [&surface.disparity, &surface.variance].map(|plane| f64::from(plane.row(12)[PAD + EDGE - 1]))
    };
    // The line through observations of 0, 0 and `step` at -1, 0 and 1, of which the last counts by `share`,
    // beside the weak slant of zero.
    let line = |step: f64, share: f64| {
        let (sum, first, second) = (2.0 + share, share - 1.0, 1.0 + share + 100.0 * NOISE / weight);
        let determinant = sum * second - first * first;
        // An observation that counts by a share has the noise of a whole one: sum of squared shares over that
        // of shares.
        let partly = (2.0 + share * share) / (2.0 + share);
        [share * step * (second - first) / determinant, NOISE / weight * second / determinant * partly]
    };
    // Squared differences of 0.75 to 1.25 times what is allowed for: from all to nothing.
    for (squared, share) in
        [(0.7, 1.0), (0.75, 1.0), (0.9, 0.7), (1.0, 0.5), (1.1, 0.3), (1.25, 0.0), (1.4, 0.0)]
    {
        let step = allowed * f64::sqrt(squared);
        let ([disparity, variance], [expected, noise]) = (found(step), line(step, share));
        assert!((disparity - expected).abs() < 1e-5, "{squared}: {disparity}");
        assert!((variance / noise - 1.0).abs() < 1e-3, "{squared}: {variance} {noise}");
    }
}

#[test]
fn known_pixels_keep_their_planes() {
    let observations = observations_for(slanted, |_, _| 800.0);
    let map = map_of(slanted, (P, Q), 1e-4);
    let mut surface = map_of(|_, _| 9.0, (0.0, 0.0), 1e-3);
    for y in 0..ROWS {
        (0..COLUMNS).step_by(3).for_each(|x| surface.variance.row_mut(y)[PAD + x] = 1e-5);
    }
    let rule = SupportRule { reach: (2, 2), ..RULE };
    surface
        .par_rows()
        .enumerate()
        .for_each(|(y, out)| join_row(Level::new(), (&observations, &map), rule, y, Some(1e-4), out));
    for x in 3..COLUMNS - 3 {
        let (found, variance) =
            (f64::from(surface.disparity.row(12)[PAD + x]), surface.variance.row(12)[PAD + x]);
        if x % 3 == 0 {
            assert_eq!((found, variance), (9.0, 1e-5));
        } else {
            assert!((found - slanted(x, 12)).abs() < 1e-5, "column {x}: {found}");
        }
    }
}

#[test]
fn where_nothing_observations_nothing_is_known() {
    let mut observations = ObservationMaps::empty(ROWS, COLUMNS);
    observations.noise = Padded::filled(ROWS, COLUMNS, NOISE as f32);
    let surface = joined(
        &observations,
        &map_of(slanted, (P, Q), 1.0),
        SupportRule { reach: (3, 3), slack: (0.5, 0.3), ..RULE },
    );
    assert!(surface.variance.row(5).iter().all(|&variance| variance == f32::INFINITY));
    assert_eq!(surface.disparity.row(5)[PAD + 7], slanted(7, 5) as f32);
}

/// The best windows of reach 3 for `observations`, whose windows reach across steps as guesses do.
fn best_windows(observations: &ObservationMaps, guesses: &SurfacePlanes) -> SurfacePlanes {
    let windows = joined(observations, guesses, SupportRule { reach: (3, 3), slack: (0.5, 0.3), ..RULE });
    let mut map = SurfacePlanes::unknown(ROWS, COLUMNS);
    map.par_rows()
        .enumerate()
        .for_each(|(y, out)| take_best_window(Level::new(), (&windows, guesses), (3, 3), y, out));
    map
}

#[test]
fn at_a_step_a_window_of_the_pixels_own_side_is_taken() {
    // The step is within the slack of the guesses, so that windows on it hold both sides; the slants differ,
    // too.
    let roof =
        |x: usize, y: usize| slanted(x, y) + if x < EDGE { 0.0 } else { 0.6 - 0.05 * (x - EDGE) as f64 };
    let observations = observations_for(roof, |_, _| 800.0);
    let map = best_windows(&observations, &map_of(|x, y| roof(x, y) + 0.2, (0.0, 0.0), 1e-3));
    for y in 0..ROWS {
        for x in 0..COLUMNS {
            let found = f64::from(map.disparity.row(y)[PAD + x]);
            // Slants are drawn to zero by 100 noise / (28 x 7 x weight) = 0.1 %, in cut windows by 1 %;
            // carried 3 px at most.
            let bound = 3.0 * (P + 0.05) * 0.01;
            assert!((found - roof(x, y)).abs() < bound, "({x}, {y}): {found} for {}", roof(x, y));
        }
    }
}

#[test]
fn windows_of_another_surface_are_not_taken() {
    let observations = observations_for(slanted, |_, _| 800.0);
    // Windows know one surface, guesses speak of another 1.5 px away.
    let windows =
        joined(&observations, &map_of(slanted, (P, Q), 1e-3), SupportRule { reach: (3, 3), ..RULE });
    let guesses = map_of(|x, y| slanted(x, y) + 1.5, (0.0, 0.0), 1e-3);
    let mut map = SurfacePlanes::unknown(ROWS, COLUMNS);
    map.par_rows()
        .enumerate()
        .for_each(|(y, out)| take_best_window(Level::new(), (&windows, &guesses), (3, 3), y, out));
    assert!((0..ROWS).all(|y| map.variance.row(y)[PAD..PAD + COLUMNS].iter().all(|v| v.is_infinite())));
    // What no window tells is no disagreement either.
    assert!((0..ROWS).all(|y| map.texture.row(y)[PAD..PAD + COLUMNS].iter().all(|v| *v == 0.0)));
}
