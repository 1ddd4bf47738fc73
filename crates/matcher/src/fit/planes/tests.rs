//! Sums over observations by hand, and noise whose distribution is known.

use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::fit::observations::UNOBSERVED;

fn put(observations: &mut RawObservations, rows: &[Vec<Observation>], origin: f32) {
    observations.par_rows().zip(rows).for_each(|(row, observations)| row.put(observations, origin));
}

#[test]
fn observations_are_counted_from_the_origin() {
    let observation = Observation {
        base: 7.0,
        weight: 4.0,
        moment: 2.0,
        variance: 3.0,
        gradient: 5.0,
        curvature: -6.0,
        intensity: 90.0,
    };
    let mut observations = RawObservations::empty(2, 3);
    put(&mut observations, &[vec![UNOBSERVED; 3], vec![UNOBSERVED, observation, UNOBSERVED]], 5.0);
    // It stands for 7.5 px, 2.5 px from the origin.
    assert_eq!(observations.moment.row(1)[PAD..PAD + 3], [0.0, 10.0, 0.0]);
    assert_eq!(observations.inverse.row(1)[PAD..PAD + 3], [0.0, 0.25, 0.0]);
    assert_eq!(
        (observations.template.gradient.row(1)[PAD + 1], observations.template.curvature.row(1)[PAD + 1]),
        (5.0, -6.0)
    );
    assert_eq!(observations.template.intensity.row(1)[PAD + 1], 90.0);
    assert!(observations.moment.row(0).iter().all(|&moment| moment == 0.0));
}

/// Planes of one observation of weight 4 for 2 px at each pixel, with residuals of the variance `variance(x,
/// y)`; none where that is not positive.
fn observations_with(
    rows: usize,
    columns: usize,
    mut variance: impl FnMut(usize, usize) -> f64,
) -> RawObservations {
    let mut observations = RawObservations::empty(rows, columns);
    let mut observation = |x: usize, y: usize| {
        let variance = variance(x, y) as f32;
        if variance > 0.0 {
            Observation { weight: 4.0, moment: 8.0, variance, ..UNOBSERVED }
        } else {
            UNOBSERVED
        }
    };
    let all: Vec<Vec<Observation>> =
        (0..rows).map(|y| (0..columns).map(|x| observation(x, y)).collect()).collect();
    put(&mut observations, &all, 0.0);
    observations
}

#[test]
fn noise_is_the_mean_of_the_residuals_around() {
    let observation = |variance| Observation { weight: 1.0, variance, ..UNOBSERVED };
    let silent = Observation { variance: 1000.0, ..UNOBSERVED };
    let mut observations = RawObservations::empty(2, 4);
    let first = vec![observation(4.0), observation(5.0), silent, silent];
    put(&mut observations, &[first, vec![observation(3.0), silent, silent, silent]], 0.0);
    let Observations { maps: observations, residual, .. } = observations.estimate_noise(1, 2.0, 0.5, 98.0);
    // Half of the means of 4, 5 and 3, twice; then 5 alone; then no observation.
    for y in 0..2 {
        assert_eq!(observations.noise.row(y)[PAD..PAD + 4], [2.0, 2.0, 2.5, 0.5]);
    }
    assert_eq!(observations.weight.row(0)[PAD..PAD + 4], [1.0, 1.0, 0.0, 0.0]);
    assert_eq!(residual.row(0)[PAD..PAD + 4], [2.0, 2.5, 0.0, 0.0]);
}

/// A chi-squared variable over its `freedom`: the mean of the values up to `limit`, and the share of those
/// beyond. The density is summed up in small steps; beyond 12 there is next to nothing from 10 degrees on.
fn cut_at(freedom: f64, limit: f64) -> (f64, f64) {
    let (mut mass, mut moment, mut beyond) = (0.0, 0.0, 0.0);
    for z in (1..24_000).map(|step| f64::from(step) / 2000.0) {
        // Scaled to 1 at z = 1, so that it neither overflows nor vanishes.
        let density = ((0.5 * freedom - 1.0) * z.ln() - 0.5 * freedom * (z - 1.0)).exp();
        if z <= limit {
            mass += density;
            moment += z * density;
        } else {
            beyond += density;
        }
    }
    (moment / mass, beyond / (mass + beyond))
}

#[test]
fn noise_of_chi_squared_variances_is_unbiased() {
    const SIDE: usize = 100;
    // Many values, so that their harmonic mean is nearly that of all.
    const REACH: usize = 15;
    let (gain, truth) = (0.7, 3.0);
    for freedom in [10_usize, 31, 98] {
        let mut random = ChaCha8Rng::seed_from_u64(freedom as u64);
        let observations = observations_with(SIDE, SIDE, |_, _| {
            let normal = || -> f64 { StandardNormal.sample(&mut random) };
            let squares: f64 = std::iter::repeat_with(normal).take(freedom).map(|value| value * value).sum();
            gain * truth * squares / freedom as f64
        });
        let Observations { maps: observations, .. } =
            observations.estimate_noise(REACH, gain as f32, 1.0 / 12.0, freedom as f32);
        let inner: Vec<f64> = (REACH..SIDE - REACH)
            .flat_map(|y| observations.noise.row(y)[PAD + REACH..PAD + SIDE - REACH].to_vec())
            .map(f64::from)
            .collect();
        let mean = inner.iter().sum::<f64>() / inner.len() as f64 / truth;
        // Chance of the mean of all, four standard deviations of it; and what is cut off beyond four standard
        // deviations of single values. The limit is itself astray by that of the mean of 31^2 inverses, each
        // by sqrt(2 / (n - 4)) of itself.
        let n = freedom as f64;
        let deviation = (2.0 / n).sqrt();
        let chance = 4.0 * deviation / (inner.len() as f64).sqrt();
        let limit = 1.0 + 4.0 * deviation;
        let astray = 2.0 * (2.0 / (n - 4.0)).sqrt() / 31.0;
        let (least, most_cut) = cut_at(n, limit * (1.0 - astray));
        assert!(mean > least - chance && mean < 1.0 + chance, "{freedom}: {mean}, {least} +- {chance}");
        assert!(least > 0.98, "{freedom}: {least}");
        let (_, least_cut) = cut_at(n, limit * (1.0 + astray));
        let less = (0..SIDE).flat_map(|y| observations.weight.row(y)[PAD..PAD + SIDE].to_vec());
        let less = less.filter(|&weight| weight < 4.0).count() as f64;
        // Counts scatter by their root.
        let counts = [least_cut, most_cut].map(|share| share * (SIDE * SIDE) as f64);
        let bounds = [counts[0] - 4.0 * counts[0].sqrt(), counts[1] + 4.0 * counts[1].sqrt() + 1.0];
        assert!(
            less >= bounds[0] && less <= bounds[1],
            "{freedom}: {less} observations count less, {counts:?}"
        );
    }
}

#[test]
fn a_few_residuals_ten_times_as_large_change_nothing_but_their_own_observations() {
    let odd = |x: usize, y: usize| x % 4 == 1 && y % 5 == 2;
    let observations = observations_with(20, 30, |x, y| if odd(x, y) { 20.0 } else { 2.0 });
    let Observations { maps: observations, residual, .. } = observations.estimate_noise(3, 1.0, 0.1, 40.0);
    for (y, x) in (0..20).flat_map(|y| (0..30).map(move |x| (y, x))) {
        let at = |plane: &Padded| plane.row(y)[PAD + x];
        let share = if odd(x, y) { 0.1 } else { 1.0 };
        assert!((at(&observations.noise) - 2.0).abs() < 1e-5, "{x} {y}");
        assert!(
            (at(&observations.weight) - 4.0 * share).abs() < 1e-5,
            "{x} {y}: {}",
            at(&observations.weight)
        );
        assert!((at(&observations.moment) - 8.0 * share).abs() < 1e-5, "{x} {y}");
        assert!((at(&observations.inverse) * 4.0 * share - 1.0).abs() < 1e-5, "{x} {y}");
        assert_eq!(at(&residual), 2.0 * 10.0_f32.powi(i32::from(odd(x, y))));
    }
}

#[test]
fn no_observation_counts_more_beside_noisier_pixels() {
    let row = [1.0, 1.0, 1.0, 4.0, 9.0, 20.0, 20.0, 20.0];
    let observations = observations_with(1, 8, |x, _| row[x]);
    let Observations { maps: observations, .. } = observations.estimate_noise(1, 1.0, 0.1, 98.0);
    // With 98 degrees of freedom the limit is 1 + 4 sqrt(2 / 98) = 1.571 times the harmonic mean, less 2 /
    // 98. The fourth is 1.131 times its limit of 3.536 and belongs by (1.25 - 1.131) / 0.25 = 0.475, while 9
    // belongs wholly to 4, 9 and 20. The noise is (1 + 0.475 x 4 + 9) / 2.475.
    assert!(
        (observations.noise.row(0)[PAD + 3] - 4.808).abs() < 2e-3,
        "{}",
        observations.noise.row(0)[PAD + 3]
    );
    assert_eq!(observations.weight.row(0)[PAD..PAD + 8], [4.0; 8]);
}

proptest! {
    #[test]
    fn observations_count_as_much_less_as_their_residuals_exceed_the_noise(
        exponents in prop::collection::vec(-2.0_f64..3.0, 12 * 17), silent in prop::collection::vec(0.0_f64..1.0, 12 * 17),
        reach in 0_usize..=3, freedom in 1_usize..120,
    ) {
        let (rows, columns, least) = (12, 17, 0.1_f32);
        let voice = |index: usize| if silent[index] < 0.2 { 0.0 } else { 10.0_f64.powf(exponents[index]) };
        let observations = observations_with(rows, columns, |x, y| voice(y * columns + x));
        let Observations { maps: observations, residual, .. } =
            observations.estimate_noise(reach, 1.0, least, freedom as f32);
        for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
            let at = |plane: &Padded| plane.row(y)[PAD + x];
            let near: Vec<f32> = (y.saturating_sub(reach)..(y + reach + 1).min(rows))
                .flat_map(|v| (x.saturating_sub(reach)..(x + reach + 1).min(columns)).map(move |u| v * columns + u))
                .map(|index| voice(index) as f32)
                .filter(|&variance| variance > 0.0)
                .map(|variance| variance.max(least))
                .collect();
            let largest = near.iter().copied().fold(least, f32::max);
            prop_assert!(at(&observations.noise) >= least && at(&observations.noise) <= largest * (1.0 + 1e-5));
            if voice(y * columns + x) == 0.0 {
                prop_assert_eq!((at(&observations.weight), at(&observations.inverse), at(&residual)), (0.0, 0.0, 0.0));
                continue;
            }
            let own = (voice(y * columns + x) as f32).max(least);
            prop_assert_eq!(at(&residual), own);
            let share = at(&observations.weight) / 4.0;
            let exact = (at(&observations.noise) / own).min(1.0);
            let n = f64::from(freedom as f32);
            let inverse = near.iter().map(|variance| 1.0 / f64::from(*variance)).sum::<f64>() / near.len() as f64;
            let limit = (1.0 + 4.0 * (2.0 / n).sqrt()) * n / ((n - 2.0).max(1.0) * inverse);
            let over = f64::from(own) / limit;
            let close = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-4;
            let whole = 1e-4;
            prop_assert!(over > 1.0 - whole || close(share, 1.0), "{} {}", share, over);
            prop_assert!(over < 1.25 + whole || close(share, exact), "{} {}", share, exact);
            prop_assert!(share >= exact * (1.0 - 1e-4) && share <= 1.0 + 1e-4, "{} {}", share, exact);
            // The same observation, whatever it counts.
            prop_assert!((at(&observations.moment) / at(&observations.weight) - 2.0).abs() < 1e-5);
            prop_assert!((at(&observations.inverse) * at(&observations.weight) - 1.0).abs() < 1e-5);
        }
    }
}

#[test]
fn slants_are_differences_of_neighbours_unless_they_are_edges() {
    // 0.1 px a column, a step of 5 px, and a pixel without a disparity.
    let values = vec![5.0, 5.1, 5.2, 10.2, 10.3, f32::NAN];
    let surface =
        Grid::from_values(2, 6, [values.clone(), values.iter().map(|value| value + 0.2).collect()].concat());
    let planes = SurfacePlanes::of_surface(Guess { map: &surface.unwrap(), origin: 5.0 }, 0.3);
    let row = |map: &Padded| map.row(1)[PAD..PAD + 6].to_vec();
    let near = |found: Vec<f32>, wanted: [f32; 6]| {
        assert!(found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-5), "{found:?}");
    };
    near(row(&planes.disparity), [0.2, 0.3, 0.4, 5.4, 5.5, 0.0]);
    near(row(&planes.slant_x), [0.1, 0.1, 0.0, 0.0, 0.0, 0.0]);
    near(row(&planes.slant_y), [0.2, 0.2, 0.2, 0.2, 0.2, 0.0]);
}
