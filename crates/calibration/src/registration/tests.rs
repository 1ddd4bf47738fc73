//! Shifts against the simulator, whose truth is closed, and against waves.

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::*;
use epirig_core::frame::Samples;
use epirig_simulator::{Sensor, Simulator, SimulatorConfig, Texture};

/// A plane that moves by 1 px for each mm: 500 px of focal length, 500 mm away.
fn plane(columns: usize, rows: usize, change: impl FnOnce(&mut SimulatorConfig)) -> Simulator {
    let mut config = SimulatorConfig::textured_plane(columns, rows, 9);
    config.optics.focal_length_px = 500.0;
    config.texture.grain_mm = 2.0;
    change(&mut config);
    Simulator::new(config).unwrap()
}

/// Samples of an intensity in DN over columns and rows.
fn sampled(columns: usize, rows: usize, bit_depth: u8, light: impl Fn(f64, f64) -> f64) -> Frame {
    let full = f64::from(epirig_core::frame::full_scale(bit_depth));
    let levels =
        (0..rows * columns).map(|index| light((index % columns) as f64, (index / columns) as f64).round());
    let samples = if bit_depth <= 8 {
        Samples::U8(levels.map(|level| level.clamp(0.0, full) as u8).collect())
    } else {
        Samples::U16(levels.map(|level| level.clamp(0.0, full) as u16).collect())
    };
    Frame::new(rows, columns, bit_depth, samples).unwrap()
}

#[test]
fn the_simulator_moves_as_far_as_its_stage_does() {
    let simulator = plane(160, 120, |_| ());
    let first = simulator.expose(50.0, 0);
    for shift_px in [0.1, 0.25, 0.5, 0.73, 1.0, 2.4, -0.37, -7.5] {
        let found = shift_between(&first, &simulator.expose(50.0 + shift_px, 0)).unwrap();
        // What is asked of it; rounding of 19200 samples spreads it by 0.0005 px.
        assert!((found.x_px - shift_px).abs() < 0.005, "{shift_px}: {found:?}");
        assert!(found.y_px.abs() < 0.005, "{shift_px}: {found:?}");
        assert!((found.light - 1.0).abs() < 0.01, "{found:?}");
    }
}

#[test]
fn equal_frames_have_not_moved_at_all() {
    for noise in [0.0, 5.0] {
        let simulator = plane(90, 70, |config| config.sensor.read_noise_dn = noise);
        let frame = simulator.expose(50.0, 0);
        let found = shift_between(&frame, &frame).unwrap();
        assert_eq!((found.x_px, found.y_px, found.light), (0.0, 0.0, 1.0));
        assert!(found.residual_dn < 1e-3 && found.sigma_px > 0.0, "{found:?}");
    }
}

#[test]
fn large_shifts_are_found_and_their_contrary() {
    let simulator = plane(640, 480, |_| ());
    let first = simulator.expose(50.0, 0);
    for shift_px in [24.3, -24.3, 60.5, 110.0] {
        let second = simulator.expose(50.0 + shift_px, 0);
        let found = shift_between(&first, &second).unwrap();
        assert!((found.x_px - shift_px).abs() < 0.005, "{shift_px}: {found:?}");
        let back = shift_between(&second, &first).unwrap();
        assert!((back.x_px + shift_px).abs() < 0.005, "{shift_px}: {back:?}");
    }
}

#[test]
fn noise_spreads_the_answer_as_sigma_says_and_does_not_bias_it() {
    // 200 pairs: the spread is known to 5 %, the mean to 7 % of it; four of those.
    const PAIRS: u32 = 200;
    for shift_px in [0.0, 0.3, 0.5] {
        let simulator = plane(64, 48, |config| config.sensor.read_noise_dn = 8.0);
        let (first, second) = (simulator.irradiance(50.0), simulator.irradiance(50.0 + shift_px));
        let pair = |index: u32| {
            shift_between(&simulator.digitise(&first, 2 * index), &simulator.digitise(&second, 2 * index + 1))
                .unwrap()
        };
        let found: Vec<Shift> = (0..PAIRS).map(pair).collect();
        let errors: Vec<f64> = found.iter().flat_map(|shift| [shift.x_px - shift_px, shift.y_px]).collect();
        let count = errors.len() as f64;
        let sigma = (found.iter().map(|shift| shift.sigma_px.powi(2)).sum::<f64>() / f64::from(PAIRS)).sqrt();
        let bias = found.iter().map(|shift| shift.x_px - shift_px).sum::<f64>() / f64::from(PAIRS);
        let spread = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
        assert!(bias.abs() < 0.28 * sigma, "{shift_px}: bias {bias}, sigma {sigma}");
        // The worse of two directions is told, and the spread is of both.
        assert!((0.8..1.1).contains(&(spread / sigma)), "{shift_px}: spread {spread}, sigma {sigma}");
    }
}

#[test]
fn light_and_black_level_are_no_movement() {
    let wave = |x: f64, y: f64| 25.0 * (0.5 * x).sin() + 25.0 * (0.4 * y + 0.1 * x).cos();
    let first = sampled(96, 80, 8, |x, y| 100.0 + wave(x, y));
    for (gain, black, x_px, y_px) in [(0.6, 0.0, 0.0, 0.0), (1.4, 10.0, 0.35, -0.8), (0.8, 30.0, -3.2, 2.6)] {
        let second = sampled(96, 80, 8, |x, y| black + gain * (100.0 + wave(x - x_px, y - y_px)));
        let found = shift_between(&first, &second).unwrap();
        assert!((found.light - gain).abs() < 0.01, "{found:?}");
        assert!((found.x_px - x_px).abs() < 0.005 && (found.y_px - y_px).abs() < 0.005, "{found:?}");
        assert!(found.residual_dn < 0.6, "{found:?}");
    }
}

#[test]
fn of_a_texture_that_repeats_the_nearest_of_equal_shifts_counts() {
    // Periods of 10 px and 12.5 px.
    let wave = |x: f64, y: f64| {
        2000.0
            + 700.0 * (std::f64::consts::TAU * x / 10.0).sin()
            + 700.0 * (std::f64::consts::TAU * y / 12.5).sin()
    };
    let first = sampled(200, 150, 12, wave);
    for x_px in [0.0, 1.0, 3.9, -2.5] {
        let second = sampled(200, 150, 12, |x, y| wave(x - x_px, y));
        let found = shift_between(&first, &second).unwrap();
        assert!((found.x_px - x_px).abs() < 0.005 && found.y_px.abs() < 0.005, "{x_px}: {found:?}");
    }
}

#[test]
fn clipped_light_does_not_hold_the_picture() {
    // A glare that stays where it is, at full scale, over a picture that moves.
    let simulator = plane(128, 96, |_| ());
    let glare = |position_mm: f64| {
        let frame = simulator.expose(position_mm, 0);
        let Samples::U8(mut samples) = frame.samples().clone() else { panic!() };
        for y in 30..60 {
            samples[y * 128 + 40..y * 128 + 70].fill(255);
        }
        Frame::new(96, 128, 8, Samples::U8(samples)).unwrap()
    };
    let found = shift_between(&glare(50.0), &glare(50.6)).unwrap();
    assert!((found.x_px - 0.6).abs() < 0.005, "{found:?}");
    assert!(found.residual_dn < 1.0, "{found:?}");
}

#[test]
fn frames_that_show_different_things_are_refused() {
    for seed in 0..10 {
        let one = plane(64, 48, |_| ());
        let other = plane(64, 48, |config| config.texture = Texture { seed: 100 + seed, ..config.texture });
        let error = shift_between(&one.expose(50.0, 0), &other.expose(50.0, 0)).unwrap_err();
        assert!(matches!(error, ShiftError::Unlike { correlation, .. } if correlation < 0.6), "{error}");
    }
    // The same vignette does not make them alike.
    let dark = |seed: u64| {
        plane(160, 120, |config| {
            config.optics.vignetting = 0.6;
            config.texture = Texture { seed, ..config.texture };
        })
    };
    let error = shift_between(&dark(1).expose(50.0, 0), &dark(2).expose(50.0, 0)).unwrap_err();
    assert!(matches!(error, ShiftError::Unlike { .. }), "{error}");
    // Too far away to be found.
    let simulator = plane(64, 48, |_| ());
    assert!(shift_between(&simulator.expose(50.0, 0), &simulator.expose(90.0, 0)).is_err());
}

#[test]
fn noise_alone_is_no_picture() {
    let noise = |seed: u64| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let samples = (0..64 * 48).map(|_| {
            let unit: f64 = random.sample(StandardNormal);
            (100.0 + 5.0 * unit).round() as u8
        });
        Frame::new(48, 64, 8, Samples::U8(samples.collect())).unwrap()
    };
    assert!(matches!(shift_between(&noise(1), &noise(2)), Err(ShiftError::Unlike { .. })));
}

#[test]
fn what_cannot_be_seen_is_not_told() {
    let flat = sampled(64, 48, 8, |_, _| 90.0);
    assert!(matches!(shift_between(&flat, &flat), Err(ShiftError::TooLittleTexture { .. })));
    let white = sampled(64, 48, 8, |_, _| 255.0);
    assert!(matches!(shift_between(&white, &white), Err(ShiftError::TooLittleTexture { .. })));
    // Stripes do not tell of a movement along them.
    let stripes = sampled(64, 48, 8, |x, _| 90.0 + 40.0 * (0.6 * x).sin());
    assert!(matches!(shift_between(&stripes, &stripes), Err(ShiftError::TooLittleTexture { .. })));
    let simulator = plane(64, 48, |_| ());
    let deep = plane(64, 48, |config| config.sensor = Sensor::ideal(12));
    let error = shift_between(&simulator.expose(50.0, 0), &deep.expose(50.0, 0)).unwrap_err().to_string();
    assert!(error.starts_with("frames of 64 x 48 with 8 bit and 64 x 48 with 12 bit"), "{error}");
    let small = sampled(15, 48, 8, |x, y| x + y);
    assert!(matches!(shift_between(&small, &small), Err(ShiftError::TooSmall { columns: 15, .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_shift_of_waves_is_found_and_taken_back(
        x_px in -4.0..4.0_f64, y_px in -4.0..4.0_f64, phase in 0.0..6.0_f64, gain in 0.5..1.5_f64,
    ) {
        // Waves that repeat together only far outside the image.
        let wave = |x: f64, y: f64| {
            800.0 * ((0.41 * x + 0.13 * y + phase).sin() + (0.23 * y - 0.37 * x).cos() + (0.09 * x - 0.53 * y).sin())
        };
        let first = sampled(96, 72, 13, |x, y| 3000.0 + wave(x, y));
        let second = sampled(96, 72, 13, |x, y| 3600.0 + gain * wave(x - x_px, y - y_px));
        let there = shift_between(&first, &second).unwrap();
        prop_assert!((there.x_px - x_px).abs() < 0.005 && (there.y_px - y_px).abs() < 0.005, "{there:?}");
        prop_assert!((there.light / gain - 1.0).abs() < 0.01, "{there:?}");
        let back = shift_between(&second, &first).unwrap();
        prop_assert!((back.x_px + there.x_px).abs() < 0.005 && (back.y_px + there.y_px).abs() < 0.005);
    }

    #[test]
    fn whatever_the_frames_hold_there_is_an_answer_or_a_reason(
        rows in 1_usize..40, columns in 1_usize..40, seed in any::<u64>(), levels in 1_u32..256,
    ) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut frame = || {
            let samples = (0..rows * columns).map(|_| random.random_range(0..levels) as u8).collect();
            Frame::new(rows, columns, 8, Samples::U8(samples)).unwrap()
        };
        let (first, second) = (frame(), frame());
        for found in [shift_between(&first, &second), shift_between(&first, &first)].into_iter().flatten() {
            prop_assert!(found.x_px.is_finite() && found.y_px.is_finite() && found.sigma_px > 0.0);
            prop_assert!(found.sigma_px <= WORST_SIGMA_PX && found.residual_dn.is_finite());
        }
    }
}
