//! The gains of frames, against a simulator whose lamp flickers as stated.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::*;
use epirig_core::grid::Grid;
use epirig_core::progress::Silent;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_simulator::{Scene, Simulator, SimulatorConfig};

const FRAMES: usize = 13;

/// A plane with 8 px of disparity, 1.4 DN of noise at 8 bit.
fn simulator(seed: u64, change: impl FnOnce(&mut SimulatorConfig)) -> Simulator {
    let mut config = SimulatorConfig::textured_plane(192, 144, FRAMES);
    config.sensor.read_noise_dn = 1.4;
    config.sensor.seed = seed;
    config.texture.seed = seed;
    change(&mut config);
    Simulator::new(config).unwrap()
}

/// Gains of a lamp that flickers by `share`, with geometric mean 1.
fn lamp(share: f64, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let units: Vec<f64> = (0..FRAMES).map(|_| random.sample(StandardNormal)).collect();
    let mean = units.iter().sum::<f64>() / FRAMES as f64;
    units.iter().map(|unit| (share * (unit - mean)).exp()).collect()
}

/// The volume that the simulator gives under that lamp; `paint` changes what falls on the sensor.
fn volume(simulator: &Simulator, lamp: &[f64], paint: impl Fn(&mut Grid<f32>)) -> Volume {
    let positions = simulator.config().scan.positions_mm();
    let optics = &simulator.config().optics;
    let mut volume = Volume::new(optics.rows, optics.columns, 8, Tau::from_positions(&positions).unwrap());
    for (index, &position_mm) in positions.iter().enumerate() {
        let mut light = simulator.irradiance(position_mm);
        paint(&mut light);
        light.values_mut().iter_mut().for_each(|light| *light *= lamp[index] as f32);
        volume.insert(index, &simulator.digitise(&light, index as u32)).unwrap();
    }
    volume
}

fn errors(found: &FrameGains, lamp: &[f64]) -> Vec<f64> {
    found.gain.iter().zip(lamp).map(|(found, truth)| (found / truth).ln()).collect()
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn flicker_of_three_thousandths_comes_down_to_what_noise_allows() {
    let (mut squares, mut stated, runs) = (0.0, 0.0, 6);
    for seed in 0..runs {
        let (simulator, lamp) = (simulator(seed, |_| ()), lamp(0.003, seed));
        // The disparity is right to a px.
        let found = frame_gains(
            &volume(&simulator, &lamp, |_| ()),
            8.0 + [-1.0, 0.3, 1.0][seed as usize % 3],
            &Silent,
        )
        .unwrap();
        let errors = errors(&found, &lamp);
        assert!(found.significant && (found.disparity_px - 8.0).abs() < 0.1, "{found:?}");
        let product: f64 = found.gain.iter().map(|gain| gain.ln()).sum();
        assert!(product.abs() < 1e-9, "{product}");
        // What is asked of it: 0.02 %.
        assert!(root_mean_square(&errors) < 0.0002, "{} {found:?}", root_mean_square(&errors));
        squares += root_mean_square(&errors).powi(2);
        stated += root_mean_square(&found.sigma).powi(2);
    }
    // 72 squares are known to 17 %, if they were independent: what is wrong with a window's place is common
    // to its frames.
    let ratio = (squares / stated).sqrt();
    assert!((0.5..1.5).contains(&ratio), "{ratio}");
}

#[test]
fn slanted_surfaces_and_standing_backgrounds_do_no_harm() {
    let slanted = simulator(11, |config| {
        config.scene = Scene::Plane { distance_mm: 500.0, slope_x: 0.4, slope_y: 0.2 };
    });
    let lamp = lamp(0.003, 21);
    let found = frame_gains(&volume(&slanted, &lamp, |_| ()), 8.0, &Silent).unwrap();
    let error = root_mean_square(&errors(&found, &lamp));
    assert!(error < 0.0002_f64.max(2.0 * root_mean_square(&found.sigma)), "{error} {found:?}");
    // A quarter of the view stands still: stripes under the same lamp.
    let standing = |light: &mut Grid<f32>| {
        for y in 0..36 {
            let row = light.row_mut(y).iter_mut().enumerate();
            row.for_each(|(x, light)| *light = 0.5 + 0.3 * (0.5 * x as f32 + 0.2 * y as f32).sin());
        }
    };
    let found = frame_gains(&volume(&simulator(12, |_| ()), &lamp, standing), 8.0, &Silent).unwrap();
    let error = root_mean_square(&errors(&found, &lamp));
    assert!((found.disparity_px - 8.0).abs() < 0.2, "{found:?}");
    assert!(error < 0.0002_f64.max(2.0 * root_mean_square(&found.sigma)), "{error} {found:?}");
}

#[test]
fn a_surface_that_crosses_the_view_is_followed_from_window_to_window() {
    // 150 px of disparity in 192 columns: few points are in all frames.
    let simulator = simulator(5, |config| config.scan.step_mm *= 150.0 / 8.0);
    let lamp = lamp(0.003, 6);
    let found = frame_gains(&volume(&simulator, &lamp, |_| ()), 150.0, &Silent).unwrap();
    let errors = errors(&found, &lamp);
    assert!(
        errors.iter().zip(&found.sigma).all(|(error, sigma)| error.abs() < 4.0 * sigma),
        "{errors:?} {found:?}"
    );
    assert!(root_mean_square(&errors) < 0.001, "{errors:?}");
}

#[test]
fn a_steady_lamp_is_left_alone() {
    let (simulator, lamp) = (simulator(3, |_| ()), vec![1.0; FRAMES]);
    let found = frame_gains(&volume(&simulator, &lamp, |_| ()), 8.0, &Silent).unwrap();
    assert!(errors(&found, &lamp).iter().zip(&found.sigma).all(|(error, sigma)| error.abs() < 4.0 * sigma));
    if !found.significant {
        assert!(found.gain.iter().all(|&gain| gain == 1.0));
    }
    assert!(found.flicker < 0.0002, "{found:?}");
}

#[test]
fn frames_without_a_common_surface_are_refused() {
    let simulator = simulator(3, |_| ());
    let volume = volume(&simulator, &[1.0; FRAMES], |_| ());
    assert!(matches!(frame_gains(&volume, f64::NAN, &Silent), Err(GainError::NoDisparity(_))));
    let error = frame_gains(&volume, 12.0 * 190.0, &Silent).unwrap_err();
    assert!(matches!(error, GainError::TooFewWindows { .. } | GainError::Apart { .. }), "{error}");
    // Windows in the first two frames, and others in the last two.
    let window = |seen: [usize; 2]| {
        (0..4).map(|t| if seen.contains(&t) { 1.0 } else { f64::NAN }).collect::<Vec<f64>>()
    };
    let apart: Vec<Vec<f64>> =
        (0..20).map(|index| window(if index % 2 == 0 { [0, 1] } else { [2, 3] })).collect();
    assert!(matches!(fit(&apart, 4), Err(GainError::Apart { .. })));
}

#[test]
fn the_gains_of_exact_windows_are_exact() {
    // Levels 1 and 2 DN of logarithm; gains 0.1, -0.1 and 0; the second window does not see the first frame.
    let gains = [0.1, -0.1, 0.0];
    let window = |level: f64, from: usize| {
        (0..3).map(|t| if t < from { f64::NAN } else { level + gains[t] }).collect::<Vec<_>>()
    };
    let (found, _) = fit(&[window(1.0, 0), window(2.0, 1), window(1.5, 0)], 3).unwrap();
    assert!(found.iter().zip(gains).all(|(found, truth)| (found - truth).abs() < 1e-9), "{found:?}");
}

#[test]
fn the_disparity_is_guessed_where_the_picture_allows() {
    let simulator = simulator(4, |_| ());
    let textured = volume(&simulator, &lamp(0.003, 4), |_| ());
    assert!((dominant_disparity(&textured, &Silent).unwrap() - 8.0).abs() < 0.5);
    let bare = volume(&simulator, &[1.0; FRAMES], |light| light.values_mut().fill(0.5));
    assert!(matches!(dominant_disparity(&bare, &Silent), Err(GainError::Shift { frame: 0, .. })));
}
