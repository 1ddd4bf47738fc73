mod posed;

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::lens::{Distortion, Lens};
use crate::photometry::Correction;
use epirig_core::frame::{Frame, FrameFormat, Samples};
use epirig_core::grid::Grid;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;

const ROWS: usize = 160;
const COLUMNS: usize = 200;

fn frame(bit_depth: u8, mut value: impl FnMut(f64, f64) -> f64) -> Frame {
    let places = (0..ROWS * COLUMNS).map(|index| ((index % COLUMNS) as f64, (index / COLUMNS) as f64));
    let values = places.map(|(x, y)| value(x, y).round());
    let samples = if bit_depth <= 8 {
        Samples::U8(values.map(|value| value as u8).collect())
    } else {
        Samples::U16(values.map(|value| value as u16).collect())
    };
    Frame::new(ROWS, COLUMNS, bit_depth, samples).unwrap()
}

fn rig() -> Mapping {
    let distortion = Distortion { k1: -0.02, ..Distortion::default() };
    let lens = Lens { distortion, ..Lens::pinhole(555.0, 103.0, 77.0) };
    Mapping::fitting(lens, 0.7_f64.to_radians(), 0.4_f64.to_radians(), ROWS, COLUMNS).unwrap()
}

/// A mapping that shifts the image by a part of a pixel, and keeps 10 px off its borders.
fn shifted(x_px: f64, y_px: f64) -> Mapping {
    let lens = Lens::pinhole(555.0, 103.0, 77.0);
    let camera = RectifiedCamera {
        rows: ROWS - 20,
        columns: COLUMNS - 20,
        focal_length_px: 555.0,
        principal_point_x_px: 103.0 - 10.0 - x_px,
        principal_point_y_px: 77.0 - 10.0 - y_px,
    };
    Mapping { lens, roll_rad: 0.0, pan_rad: 0.0, raw_rows: ROWS, raw_columns: COLUMNS, camera }
}

fn rectified(mapping: Mapping, correction: Correction, frames: &[Frame]) -> Volume {
    let rectifier = Rectifier::new(mapping, correction).unwrap();
    let mut volume = rectifier.volume(frames[0].bit_depth(), Tau::equidistant(frames.len().max(2)).unwrap());
    rectifier.insert(&mut volume, 0, frames).unwrap();
    volume
}

fn plane(volume: &Volume, t: usize) -> Grid<f32> {
    let mut plane = Grid::filled(volume.rows(), volume.columns(), 0.0);
    (0..volume.rows()).for_each(|y| volume.copy_row(y, t, plane.row_mut(y)));
    plane
}

#[test]
fn a_texture_is_found_where_the_lens_puts_it() {
    let mapping = rig();
    // Waves of 5 px and more: the spline's error grows with the sixth power of the frequency (Unser 1999),
    // see `spline`.
    let waves = [(1.2, 0.4, 0.3), (-0.4, 1.1, 1.1), (0.8, -0.8, 2.0), (0.21, 0.13, 0.7)];
    let amplitude = 5000.0;
    for phase in [0.0, 1.0, 2.0] {
        let scene = |x: f64, y: f64| {
            32_000.0
                + amplitude
                    * waves.iter().map(|(a, b, c)| (a * x + b * y + c * (1.0 + phase)).sin()).sum::<f64>()
        };
        let volume = rectified(mapping, Correction::default(), &[frame(16, scene)]);
        let found = plane(&volume, 0);
        let truth = |x: f64, y: f64| {
            let (raw_x, raw_y) = mapping.raw(x, y);
            scene(raw_x, raw_y)
        };
        // Error and gradient along x of every pixel.
        let mut values = Grid::filled(found.rows(), found.columns(), (0.0, 0.0));
        let mut squares = 0.0;
        for y in 0..found.rows() {
            for x in 0..found.columns() {
                let (u, v) = (x as f64, y as f64);
                let gradient = (truth(u + 1e-3, v) - truth(u - 1e-3, v)) / 2e-3;
                values.row_mut(y)[x] = (f64::from(found.at(x, y)) - truth(u, v), gradient);
                squares += gradient * gradient;
            }
        }
        let gradient = (squares / values.values().len() as f64).sqrt();
        let largest = values.values().iter().map(|(error, _)| error.abs()).fold(0.0, f64::max);
        // As a shift of a typical gradient.
        assert!(largest / gradient < 0.002, "{} px", largest / gradient);
        let side = 9;
        for y in (0..=found.rows() - side).step_by(side) {
            for x in (0..=found.columns() - side).step_by(side) {
                let window = values.cropped(x..x + side, y..y + side);
                let (mut product, mut energy) = (0.0, 0.0);
                window.values().iter().for_each(|(error, gradient)| {
                    product += error * gradient;
                    energy += gradient * gradient;
                });
                assert!((product / energy).abs() < 0.001, "({x}, {y}): {} px", product / energy);
            }
        }
    }
}

#[test]
fn a_ramp_is_followed_up_to_the_border_that_is_kept() {
    let mapping = rig();
    let gradient = 300.0;
    let volume =
        rectified(mapping, Correction::default(), &[frame(16, |x, y| 500.0 + gradient * x + 10.0 * y)]);
    let found = plane(&volume, 0);
    for y in 0..found.rows() {
        for x in 0..found.columns() {
            let (raw_x, raw_y) = mapping.raw(x as f64, y as f64);
            assert!(raw_x >= BORDER_PX && raw_x <= (COLUMNS - 1) as f64 - BORDER_PX);
            let error = f64::from(found.at(x, y)) - (500.0 + gradient * raw_x + 10.0 * raw_y);
            // 0.0002 px of either gradient, half a count of 2 DN, and the rounding of sums of 32 bit floats
            // up to 65535.
            assert!(error.abs() < 0.0002 * (gradient + 10.0) + 1.05, "({x}, {y}): {error}");
        }
    }
}

#[test]
fn a_camera_that_needs_nothing_keeps_its_samples() {
    let lens = Lens::pinhole(555.0, 103.3, 77.7);
    let mapping = Mapping::fitting(lens, 0.0, 0.0, ROWS, COLUMNS).unwrap();
    for bit_depth in [8, 12] {
        let frames: Vec<Frame> =
            (0..9).map(|t| frame(bit_depth, |x, y| (31.0 * x + 17.0 * y + f64::from(t)) % 251.0)).collect();
        let volume = rectified(mapping, Correction::default(), &frames);
        let mut plain = Volume::new(ROWS, COLUMNS, bit_depth, volume.tau().clone());
        frames.iter().enumerate().for_each(|(t, frame)| plain.insert(t, frame).unwrap());
        assert!((0..9).all(|t| plane(&volume, t) == plane(&plain, t)));
    }
}

#[test]
fn frames_are_corrected_before_they_are_resampled() {
    let scene = |x: f64, y: f64| (900.0 + 300.0 * (0.7 * x + 0.4 * y).sin()).round();
    let dark = |x: f64, y: f64| ((7.0 * x + 3.0 * y) % 11.0).round();
    let gain = |x: f64, y: f64| if (x + y) % 2.0 == 0.0 { 0.5 } else { 0.25 };
    let of = |value: &dyn Fn(f64, f64) -> f64| {
        let values = (0..ROWS * COLUMNS).map(|i| value((i % COLUMNS) as f64, (i / COLUMNS) as f64) as f32);
        Grid::from_values(ROWS, COLUMNS, values.collect())
    };
    let correction = Correction { subtract: of(&dark), multiply: of(&gain), defective: Vec::new() };
    let raw = frame(16, |x, y| scene(x, y) / gain(x, y) + dark(x, y));
    let clean = frame(16, scene);
    let found = rectified(rig(), correction.clone(), std::slice::from_ref(&raw));
    assert_eq!(
        plane(&found, 0),
        plane(&rectified(rig(), Correction::default(), std::slice::from_ref(&clean)), 0)
    );
    let straight = Mapping::fitting(Lens::pinhole(555.0, 103.0, 77.0), 0.0, 0.0, ROWS, COLUMNS).unwrap();
    // Counts of 16 bit frames are 2 DN.
    let found = plane(&rectified(straight, correction, &[raw]), 0);
    let near = |(found, index): (&f32, usize)| {
        (f64::from(*found) - scene((index % COLUMNS) as f64, (index / COLUMNS) as f64)).abs() <= 1.0
    };
    assert!(found.values().iter().zip(0..).all(near));
}

#[test]
fn defective_pixels_leave_no_trace() {
    let defective = vec![(50, 60), (51, 60), (199, 0), (120, 64)];
    let places: Vec<(f64, f64)> = defective.iter().map(|&(x, y)| (f64::from(x), f64::from(y))).collect();
    let raw = frame(12, |x, y| if places.contains(&(x, y)) { 4095.0 } else { 1000.0 });
    let defective = defective.into_iter().map(|(x, y)| (x as usize, y as usize)).collect();
    let found = rectified(rig(), Correction { defective, ..Correction::default() }, &[raw]);
    // A count is 1/8 DN.
    assert!(plane(&found, 0).values().iter().all(|value| (value - 1000.0).abs() <= 0.125));
}

fn noise(seed: u64) -> Frame {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    frame(12, |_, _| random.random_range(1000.0..3000.0))
}

#[test]
fn threads_and_company_change_nothing() {
    let frames: Vec<Frame> = (0..11).map(noise).collect();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| rectified(rig(), Correction::default(), &frames))
    };
    let together = with(1);
    assert_eq!(together, with(3));
    let rectifier = Rectifier::new(rig(), Correction::default()).unwrap();
    let mut one_by_one = rectifier.volume(12, together.tau().clone());
    for (t, frame) in frames.iter().enumerate() {
        rectifier.insert(&mut one_by_one, t, std::slice::from_ref(frame)).unwrap();
    }
    assert_eq!(together, one_by_one);
}

/// Variance of a sample at `fraction` made of pixels with independent noise of variance 1, from the frequency
/// response of the spline.
fn noise_share(fraction: f64) -> f64 {
    let steps = 2000;
    let share = |step: i32| {
        let omega = TAU * (f64::from(step) + 0.5) / f64::from(steps);
        let (mut real, mut imaginary) = (0.0, 0.0);
        for offset in -2..=3 {
            let distance = (fraction - f64::from(offset)).abs();
            let weight = [(3.0, 1.0), (2.0, -6.0), (1.0, 15.0)].map(|(reach, sign)| {
                let inside: f64 = reach - distance;
                sign * inside.max(0.0).powi(5) / 120.0
            });
            let weight: f64 = weight.iter().sum();
            real += weight * (omega * f64::from(offset)).cos();
            imaginary += weight * (omega * f64::from(offset)).sin();
        }
        let samples = (66.0 + 52.0 * omega.cos() + 2.0 * (2.0 * omega).cos()) / 120.0;
        (real * real + imaginary * imaginary) / (samples * samples)
    };
    (0..steps).map(share).sum::<f64>() / f64::from(steps)
}

#[test]
fn noise_is_left_as_the_kernel_predicts() {
    let frames: Vec<Frame> = (0..8).map(|t| noise(100 + t)).collect();
    let variance = |values: &mut dyn Iterator<Item = f64>| {
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        values.for_each(|value| {
            count += 1.0;
            sum += value - 2000.0;
            squares += (value - 2000.0) * (value - 2000.0);
        });
        squares / count - (sum / count) * (sum / count)
    };
    let raw = 2000.0 * 2000.0 / 12.0;
    for (x, y) in [(0.5, 0.5), (0.25, 0.0), (0.5, 0.1), (0.8, 0.3)] {
        let volume = rectified(shifted(x, y), Correction::default(), &frames);
        let planes: Vec<_> = (0..8).map(|t| plane(&volume, t)).collect();
        let found =
            variance(&mut planes.iter().flat_map(|plane| plane.values()).map(|&value| f64::from(value)));
        let expected = raw * noise_share(x) * noise_share(y);
        // 8 x 25200 samples tell a variance to 0.3 %; neighbours are correlated by half at most, which is
        // twice that.
        assert!((found / expected - 1.0).abs() < 0.02, "({x}, {y}): {found}, expected {expected}");
    }
}

#[test]
fn what_does_not_go_together_is_refused() {
    let mapping = rig();
    let mut outside = mapping;
    outside.camera.columns += 50;
    assert!(matches!(
        Rectifier::new(outside, Correction::default()),
        Err(RectifyError::Outside { y: 0, .. })
    ));
    let rectifier = Rectifier::new(mapping, Correction::default()).unwrap();
    let tau = || Tau::equidistant(2).unwrap();
    let frame = frame(12, |_, _| 7.0);
    let mut fine = rectifier.volume(12, tau());
    let late = rectifier.insert(&mut fine, 1, &[frame.clone(), frame.clone()]);
    assert!(matches!(late, Err(RectifyError::Volume { needed: 3, frames: 2, .. })));
    let mut plain = Volume::new(mapping.camera.rows, mapping.camera.columns, 12, tau());
    assert!(matches!(
        rectifier.insert(&mut plain, 0, std::slice::from_ref(&frame)),
        Err(RectifyError::Volume { .. })
    ));
    let mut shallow = rectifier.volume(8, tau());
    let error = rectifier.insert(&mut shallow, 1, &[frame]);
    let [found, expected] = [12, 8].map(|bit_depth| FrameFormat {
        rows: mapping.raw_rows,
        columns: mapping.raw_columns,
        bit_depth,
    });
    assert_eq!(error, Err(RectifyError::Frame { index: 1, found, expected }));
}
