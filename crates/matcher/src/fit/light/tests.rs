use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use crate::fit::observations::{Observation, UNOBSERVED};
use crate::fit::planes::{Observations, RawObservations};
use epirig_core::grid::Grid;

const ROWS: usize = 64;
const COLUMNS: usize = 96;
/// S of the formulas.
const SPREAD: f32 = 4.0;
const DISPARITY_PX: f32 = 7.0;
const NOISE_DN: f32 = 0.5;

/// Independent gradients and intensities on a surface, in light that drifts by `light` of place and
/// intensity, around `guess`.
fn observed(
    surface: impl Fn(f32, f32) -> f32,
    light: impl Fn(f32, f32, f32) -> f32,
    guess: &Grid<f32>,
) -> Observations {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut observations = RawObservations::empty(ROWS, COLUMNS);
    let rows: Vec<Vec<Observation>> = (0..ROWS)
        .map(|y| {
            let mut row = vec![UNOBSERVED; COLUMNS];
            for (x, observation) in row.iter_mut().enumerate() {
                let [gradient, noise]: [f32; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
                let (gradient, intensity) = (8.0 * gradient, random.random_range(20.0..220.0));
                let (place_x, place_y) = (x as f32, y as f32);
                let base = guess.at(x, y);
                let slope = gradient * (base - surface(place_x, place_y))
                    + light(place_x, place_y, intensity)
                    + NOISE_DN / SPREAD.sqrt() * noise;
                *observation = Observation {
                    base,
                    weight: gradient * gradient * SPREAD,
                    moment: -gradient * SPREAD * slope,
                    variance: NOISE_DN * NOISE_DN,
                    gradient,
                    curvature: 0.0,
                    intensity,
                };
            }
            row
        })
        .collect();
    observations.par_rows().zip(&rows).for_each(|(row, observations)| row.put(observations, 0.0));
    observations.estimate_noise(3, 1.0, 0.01, 30.0)
}

/// The weighted mean of what observations are off, in px, in the middle of the map, and their root
/// mean square over what noise alone leaves.
fn off(observations: &ObservationMaps, surface: impl Fn(f32, f32) -> f32) -> (f32, f32) {
    let [mut moments, mut weights, mut squares, mut count] = [0.0; 4];
    for y in 16..ROWS - 16 {
        for x in 16..COLUMNS - 16 {
            let place = PAD + x;
            let weight = observations.weight.row(y)[place];
            let away = observations.moment.row(y)[place] - weight * surface(x as f32, y as f32);
            moments += away;
            weights += weight;
            squares += away * away * observations.inverse.row(y)[place] / (NOISE_DN * NOISE_DN);
            count += 1.0;
        }
    }
    (moments / weights, (squares / count).sqrt())
}

fn tilted(x: f32, y: f32) -> f32 {
    DISPARITY_PX + 0.02 * x - 0.01 * y
}

/// Five per cent more light at the end, unevenly, and half a DN: many times the noise.
fn drifting(x: f32, y: f32, intensity: f32) -> f32 {
    (0.05 + 0.0004 * x) * intensity - 0.5 - 0.002 * y
}

#[test]
fn drifting_light_is_told_from_the_surface() {
    // The guesses follow the light, as a search does: each pixel believes its own.
    let mut guess = Grid::filled(ROWS, COLUMNS, 0.0);
    for y in 0..ROWS {
        for x in 0..COLUMNS {
            let wrong = if (x + y) % 2 == 0 { 0.2 } else { -0.15 };
            guess.row_mut(y)[x] = tilted(x as f32, y as f32) + wrong;
        }
    }
    let Observations { maps: mut observations, template, .. } = observed(tilted, drifting, &guess);
    let (_, before) = off(&observations, tilted);
    assert!(before > 20.0, "{before}");
    take_off_light(&mut observations, &template, Guess { map: &guess, origin: 0.0 }, None);
    let (mean, after) = off(&observations, tilted);
    // The mean of 2,000 observations is known to a thousandth of a px; six unknowns in 600 pixels
    // take a hundredth of the variance, and add as much where they are wrong.
    assert!(mean.abs() < 0.003 && (after - 1.0).abs() < 0.05, "{mean} px, {after} of the noise");
}

#[test]
fn steady_light_takes_hardly_anything() {
    let guess = Grid::filled(ROWS, COLUMNS, DISPARITY_PX);
    let Observations { maps: mut observations, template, .. } = observed(tilted, |_, _, _| 0.0, &guess);
    let before = off(&observations, tilted).1;
    take_off_light(&mut observations, &template, Guess { map: &guess, origin: 0.0 }, None);
    let after = off(&observations, tilted).1;
    assert!((after / before - 1.0).abs() < 0.02, "{before} {after}");
}

#[test]
fn squares_that_two_surfaces_share_tell_nothing_wrong() {
    // A step edge of 40 px that no square can follow.
    let stepped = |x: f32, y: f32| tilted(x, y) + if x + 0.5 * y > 64.0 { 40.0 } else { 0.0 };
    let mut guess = Grid::filled(ROWS, COLUMNS, 0.0);
    for y in 0..ROWS {
        for x in 0..COLUMNS {
            guess.row_mut(y)[x] = stepped(x as f32, y as f32);
        }
    }
    let Observations { maps: mut observations, template, .. } = observed(stepped, drifting, &guess);
    take_off_light(&mut observations, &template, Guess { map: &guess, origin: 0.0 }, None);
    let (mean, after) = off(&observations, stepped);
    assert!(mean.abs() < 0.003 && (after - 1.0).abs() < 0.05, "{mean} px, {after} of the noise");
}

#[test]
fn nothing_observed_changes_nothing() {
    let guess = Grid::filled(ROWS, COLUMNS, f32::NAN);
    let raw = RawObservations::empty(ROWS, COLUMNS);
    let Observations { maps: mut observations, template, .. } = raw.estimate_noise(3, 1.0, 0.01, 30.0);
    take_off_light(&mut observations, &template, Guess { map: &guess, origin: 0.0 }, None);
    assert!(observations.moment.values.iter().all(|moment| *moment == 0.0));
}
