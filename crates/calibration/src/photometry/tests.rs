//! Dark and flat frames, flicker and records, against fields and noise that are known.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::*;
use epirig_core::frame::{Frame, Samples};
use epirig_core::grid::Grid;
use epirig_core::image::reduced_frame;
use epirig_simulator::{Optics, SimulatorConfig};

const ROWS: usize = 120;
const COLUMNS: usize = 160;

/// A frame of 8 bit of a light in DN over columns and rows, with Gaussian noise.
fn noisy(noise_dn: f64, seed: u64, light: impl Fn(usize, usize) -> f64) -> Frame {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let samples = (0..ROWS * COLUMNS).map(|index| {
        let unit: f64 = random.sample(StandardNormal);
        (light(index % COLUMNS, index / COLUMNS) + noise_dn * unit).round().clamp(0.0, 255.0) as u8
    });
    Frame::new(ROWS, COLUMNS, 8, Samples::U8(samples.collect())).unwrap()
}

fn series(frames: u64, seed: u64, noise_dn: f64, light: impl Fn(usize, usize) -> f64) -> Vec<Frame> {
    (0..frames).map(|frame| noisy(noise_dn, 1000 * seed + frame, &light)).collect()
}

/// A frame corrected, in DN.
fn corrected(correction: &Correction, frame: &Frame) -> Grid<f32> {
    let mut light = reduced_frame(frame, 1);
    if let Some(dark) = &correction.subtract {
        light = light.zip_map(dark, |light, dark| light - dark);
    }
    if let Some(factor) = &correction.multiply {
        light = light.zip_map(factor, |light, factor| light * factor);
    }
    outliers::replace(&mut light, &correction.defective);
    light
}

fn with_vignetting(vignetting: f64) -> Optics {
    Optics { vignetting, ..SimulatorConfig::textured_plane(COLUMNS, ROWS, 3).optics }
}

fn flats(optics: &Optics, frames: u64, seed: u64) -> Vec<Frame> {
    series(frames, seed, 1.4, |x, y| 200.0 * optics.transmission(x as f64, y as f64))
}

/// The gain that a found field has.
fn gain(found: &(FlatField, Option<Grid<f32>>)) -> Grid<f32> {
    match (&found.0.model, &found.1) {
        (FlatModel::Polynomial(polynomial), None) => polynomial.image(),
        (FlatModel::PerPixel, Some(map)) => map.clone(),
        other => panic!("{other:?}"),
    }
}

/// Largest departure of the gain from the truth, of which only the form counts, in %.
fn worst_percent(gain: &Grid<f32>, optics: &Optics) -> f64 {
    let ratio = |index: usize| {
        let (x, y) = ((index % COLUMNS) as f64, (index / COLUMNS) as f64);
        f64::from(gain.values()[index]) / optics.transmission(x, y)
    };
    let mean = (0..ROWS * COLUMNS).map(ratio).sum::<f64>() / (ROWS * COLUMNS) as f64;
    (0..ROWS * COLUMNS).map(|index| 100.0 * (ratio(index) / mean - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn less_than_three_thousandths_of_the_vignetting_are_left() {
    for (index, vignetting) in [0.0, 0.15, 0.25, 0.4].into_iter().enumerate() {
        for frames in [4, 16] {
            let optics = with_vignetting(vignetting);
            let found =
                flat_field(&flats(&optics, frames, index as u64), None, FlatMethod::Automatic).unwrap();
            let gain = gain(&found);
            let mean =
                gain.values().iter().map(|&gain| f64::from(gain)).sum::<f64>() / gain.values().len() as f64;
            assert!((mean - 1.0).abs() < 1e-6, "{mean}");
            // 0.3 % is asked of it. The image is small: its cells have 192 px, and noise comes to that.
            let (worst, noise) = (worst_percent(&gain, &optics), found.0.sigma_percent.unwrap());
            assert!(
                worst < 0.3 + 4.0 * noise,
                "{vignetting}, {frames} frames: {worst} %, {:?}",
                found.0.trials
            );
            assert!(
                matches!(found.0.model, FlatModel::Polynomial(_)),
                "a map has noise only: {:?}",
                found.0.trials
            );
            let corner = found.0.vignetting_percent;
            assert!((corner - 100.0 * vignetting).abs() < 0.4, "{vignetting}: {corner} %");
        }
    }
}

#[test]
fn the_paper_s_polynomial_will_do_for_little_vignetting_and_not_for_much() {
    let worst = |vignetting: f64| {
        let optics = with_vignetting(vignetting);
        let found = flat_field(&flats(&optics, 8, 3), None, FlatMethod::Polynomial(3)).unwrap();
        assert!(found.0.trials.is_empty() && found.0.residual_percent.len() == 10);
        (worst_percent(&gain(&found), &optics), found.0.residual_rms_percent)
    };
    // 1 / (1 + s)^2 = 1 - 2 s + 3 s^2 - ..., and s = s_c (0.64 u^2 + 0.36 v^2) with s_c = 0.0847 for 15 %. By
    // Legendre polynomials, least squares leave 8/35 of u^4 and v^4 and 4/9 of u^2 v^2 in the corner: 3 s_c^2
    // (0.41 x 8/35 + 0.13 x 8/35 + 2 x 0.23 x 4/9) = 0.70 %, and noise.
    let (small, residual) = worst(0.15);
    assert!((small - 0.70).abs() < 0.1 && residual < 0.15, "{small} {residual}");
    // For 40 % s_c is 0.29 and the same term 8 %, less those of higher order.
    let (large, residual) = worst(0.4);
    assert!(large > 3.0 && residual > 0.3, "{large} {residual}");
}

#[test]
fn a_single_flat_frame_is_enough_for_a_polynomial() {
    let optics = with_vignetting(0.25);
    let found = flat_field(&flats(&optics, 1, 5), None, FlatMethod::Automatic).unwrap();
    let worst = worst_percent(&gain(&found), &optics);
    // A cell is known to 0.05 %; a fit of up to 45 coefficients to 100 cells has in the corners about twice
    // that, and four times again.
    assert!(worst < 0.4, "{worst} %, {:?}", found.0.trials);
    assert!(found.0.trials.iter().all(|trial| trial.model != TrialModel::PerPixel));
    let map = flat_field(&flats(&optics, 1, 5), None, FlatMethod::PerPixel).unwrap();
    assert_eq!(map.0.sigma_percent, None);
}

#[test]
fn a_map_wins_only_if_pixels_differ_by_more_than_its_noise() {
    // 1.4 / 200 / sqrt 16 = 0.18 % of noise in the map, against pixels that differ by 0 %, and by 0.6 %.
    let pixels = |x: usize, y: usize| {
        let mut random = ChaCha8Rng::seed_from_u64((y * COLUMNS + x) as u64);
        let unit: f64 = random.sample(StandardNormal);
        unit
    };
    for (spread, map) in [(0.0, false), (0.006, true)] {
        let frames = series(16, 7, 1.4, |x, y| 200.0 * (1.0 + spread * pixels(x, y)));
        let (field, _) = flat_field(&frames, None, FlatMethod::Automatic).unwrap();
        assert_eq!(field.model == FlatModel::PerPixel, map, "{spread}: {:?}", field.trials);
        let errors = |model| field.trials.iter().find(|trial| trial.model == model).unwrap().error_percent;
        let of_map = (1.4_f64.powi(2) + 1.0 / 12.0).sqrt() / 2.0 / 4.0;
        // From 19200 differences, known to 1 / sqrt(2 x 19200) = 0.5 %; four of those.
        assert!((errors(TrialModel::PerPixel) / of_map - 1.0).abs() < 0.02, "{:?}", field.trials);
        if map {
            let of_level = errors(TrialModel::Polynomial(0));
            assert!((of_level / 0.6 - 1.0).abs() < 0.03, "{of_level}");
        }
    }
}

#[test]
fn the_stated_standard_deviation_is_that_of_the_correction() {
    for method in [FlatMethod::Polynomial(3), FlatMethod::PerPixel] {
        let (mut found, mut stated, runs) = (0.0, 0.0, 30);
        for seed in 0..runs {
            let result = flat_field(&series(4, 50 + seed, 1.4, |_, _| 150.0), None, method).unwrap();
            let gain = gain(&result);
            found += gain.values().iter().map(|&gain| (f64::from(gain) - 1.0).powi(2)).sum::<f64>()
                / gain.values().len() as f64;
            stated += (result.0.sigma_percent.unwrap() / 100.0).powi(2);
        }
        let ratio = (found / stated).sqrt();
        // A polynomial has 9 degrees of freedom but for the level, of 10: 0.95. Their 270 squares are known
        // to 9 %, the root to 4.3 %; beyond the middles of the outer cells it is known worse than in the
        // cells, which raises it by some per cent.
        assert!((0.78..1.25).contains(&ratio), "{method:?}: {ratio}");
    }
}

#[test]
fn flat_frames_that_will_not_do_are_refused_with_the_reason() {
    let refuse = |frames: &[Frame]| flat_field(frames, None, FlatMethod::Automatic).unwrap_err();
    assert_eq!(refuse(&[]), PhotometryError::NoFrames { what: "flat" });
    let error = refuse(&series(4, 1, 1.4, |x, _| if x < 3 { 300.0 } else { 200.0 }));
    assert!(
        matches!(error, PhotometryError::Saturated { percent, .. } if (percent - 1.875).abs() < 0.01),
        "{error}"
    );
    let error = refuse(&series(4, 1, 1.4, |x, y| if x < 16 && y < 12 { 8.0 } else { 200.0 }));
    assert!(matches!(error, PhotometryError::TooDark { at: (7, 5), .. }), "{error}");
    let with = |index: usize, light: &dyn Fn(usize, usize) -> f64| {
        let mut frames = series(6, 2, 1.4, |_, _| 180.0);
        frames[index] = noisy(1.4, 99, light);
        frames
    };
    let error = refuse(&with(4, &|_, _| 150.0));
    assert!(
        matches!(error, PhotometryError::LampUnsteady { index: 4, percent, .. } if (percent + 16.7).abs() < 1.0),
        "{error}"
    );
    let error = refuse(&with(2, &|x, y| if x > 120 && y > 90 { 150.0 } else { 180.0 }));
    assert!(matches!(error, PhotometryError::FrameDiffers { index: 2, at: (129.., 89..), .. }), "{error}");
    assert!(error.to_string().starts_with("flat frame 2 differs from the others by -"), "{error}");
    let error = refuse(&series(6, 3, 1.4, |x, y| if 2 * x + y > 190 { 170.0 } else { 200.0 }));
    assert!(matches!(error, PhotometryError::NotUniform { .. }), "{error}");
    let error = flat_field(&series(2, 3, 1.4, |_, _| 200.0), None, FlatMethod::Polynomial(9)).unwrap_err();
    assert!(matches!(error, PhotometryError::Undetermined { order: 9, .. }), "{error}");
}

#[test]
fn flicker_and_dust_are_no_reason_to_refuse() {
    // A lamp that changes by 3 %, and a grain that takes 20 % over 7 px.
    let optics = with_vignetting(0.2);
    let light = |x: usize, y: usize| {
        let grain = if (40..47).contains(&x) && (50..57).contains(&y) { 0.8 } else { 1.0 };
        grain * optics.transmission(x as f64, y as f64)
    };
    let frames: Vec<Frame> = (0..8)
        .map(|index| noisy(1.4, index, |x, y| (190.0 + 3.0 * (index % 3) as f64) * light(x, y)))
        .collect();
    let (field, _) = flat_field(&frames, None, FlatMethod::Polynomial(6)).unwrap();
    // The lamp's 1.5 % do not count as noise of the pixels: 1.4 / 193 x sqrt(28 / 100 / 192 / 8), vignetting
    // makes it more.
    let expected = 100.0 * 1.43 / 193.0 * (28.0 / 100.0 / 192.0 / 8.0_f64).sqrt();
    assert!((field.sigma_percent.unwrap() / expected - 1.0).abs() < 0.15, "{field:?}");
}

#[test]
fn dark_frames_tell_level_noise_pattern_and_defective_pixels() {
    let defective = |x: usize, y: usize| if (x, y) == (30, 20) { 40.0 } else { 0.0 };
    let found = dark_frame(&series(16, 1, 1.4, |x, y| 12.3 + defective(x, y))).unwrap();
    // 307 200 samples of 1.43 DN: the mean to 0.0026 DN, the noise to 0.13 %; four of those.
    assert!((found.record.level_dn - 12.3).abs() < 0.011, "{}", found.record.level_dn);
    let noise_dn = (1.4_f64.powi(2) + 1.0 / 12.0).sqrt();
    assert!((found.record.noise_dn.unwrap() / noise_dn - 1.0).abs() < 0.006, "{:?}", found.record.noise_dn);
    assert_eq!(found.outliers, [Outlier { x: 30, y: 20, kind: OutlierKind::Hot }]);
    assert!(matches!(found.record.model, DarkModel::LevelDn(_)), "{:?}", found.record.model);
    // A glow of 3 DN over the width: its standard deviation is 3 / sqrt 12.
    let glow = dark_frame(&series(16, 2, 1.4, |x, _| 12.0 + 3.0 * x as f64 / COLUMNS as f64)).unwrap();
    assert_eq!(glow.record.model, DarkModel::Map);
    assert!(
        (glow.record.pattern_dn.unwrap() - 3.0 / 12.0_f64.sqrt()).abs() < 0.02,
        "{:?}",
        glow.record.pattern_dn
    );
    assert!(glow.outliers.is_empty(), "{:?}", glow.outliers);
    let one = dark_frame(&series(1, 3, 0.4, |_, _| 5.3)).unwrap();
    assert!((one.record.noise_dn, one.outliers.len()) == (None, 0), "{:?}", one.outliers);
}

#[test]
fn a_dark_level_that_is_cut_off_is_not_subtracted() {
    let dark = series(8, 1, 1.4, |_, _| 0.7);
    let found = dark_frame(&dark).unwrap();
    // A sample is 0 below 0.5: 44 % of a normal distribution with mean 0.7 and 1.4.
    assert!(
        matches!(found.record.model, DarkModel::CutOff(share) if (share - 0.443).abs() < 0.01),
        "{:?}",
        found.record.model
    );
    assert!(found.record.level_dn > 0.8, "cut off, the mean is too high: {}", found.record.level_dn);
    let (record, maps) = Photometry::find(&dark, &[], (ROWS, COLUMNS), PhotometryOptions::default()).unwrap();
    let Outcome::NotApplied(reason) = &record.dark else { panic!("{record:?}") };
    assert!(reason.contains("of the dark samples are 0"), "{reason}");
    assert_eq!(record.correction(&maps).unwrap().subtract, None);
}

#[test]
fn pixels_that_only_flat_frames_show_are_found_and_replaced() {
    let (dead, weak) = ((20, 30), (77, 3));
    let light = |x: usize, y: usize| match (x, y) {
        place if place == dead => 0.0,
        place if place == weak => 170.0,
        _ => 200.0,
    };
    let frames = series(8, 4, 1.4, light);
    let (record, maps) =
        Photometry::find(&[], &frames, (ROWS, COLUMNS), PhotometryOptions::default()).unwrap();
    let correction = record.correction(&maps).unwrap();
    assert_eq!(correction.defective, [dead, weak], "{:?}", record.defective_pixels);
    let corrected = corrected(&correction, &frames[0]);
    // The mean of eight pixels with 1.4 DN.
    assert!((corrected.at(20, 30) - 200.0).abs() < 4.0 * 0.5, "{}", corrected.at(20, 30));
    assert!(matches!(record.dark, Outcome::NotApplied(_)));
}

#[test]
fn the_record_makes_the_same_correction_again() {
    let optics = with_vignetting(0.3);
    let flat = series(6, 8, 1.4, |x, y| 12.0 + 180.0 * optics.transmission(x as f64, y as f64));
    for (dark, method) in [
        (series(6, 9, 1.4, |_, _| 12.0), FlatMethod::Automatic),
        (series(6, 9, 1.4, |x, _| 12.0 + 0.05 * x as f64), FlatMethod::PerPixel),
    ] {
        let options = PhotometryOptions { flat_field: Some(method), ..PhotometryOptions::default() };
        let (record, maps) = Photometry::find(&dark, &flat, (ROWS, COLUMNS), options).unwrap();
        let text = serde_json::to_string(&record).unwrap();
        assert!(text.len() < 8000, "maps do not belong here: {} characters", text.len());
        let again: Photometry = serde_json::from_str(&text).unwrap();
        assert_eq!(again, record);
        let correction = record.correction(&maps).unwrap();
        assert_eq!(again.correction(&maps).unwrap(), correction);
        let without = record.correction(&Maps::default());
        assert_eq!(without.is_ok(), maps == Maps::default(), "{without:?}");
        // An object of one brightness, seen through the same lens.
        let seen = noisy(0.0, 1, |x, y| 12.0 + 100.0 * optics.transmission(x as f64, y as f64));
        if method == FlatMethod::Automatic {
            let grid = CellGrid::of(&corrected(&correction, &seen));
            let mean = grid.mean();
            // Rounding to whole DN, which a smooth field does not average out everywhere.
            assert!(grid.cells().iter().all(|cell| (cell.mean / mean - 1.0).abs() < 0.005));
        }
    }
}

#[test]
fn each_part_can_be_switched_off() {
    let (dark, flat) = (series(4, 1, 1.4, |_, _| 12.0), series(4, 2, 1.4, |_, _| 150.0));
    let options =
        PhotometryOptions { dark: false, flat_field: None, defective_pixels: false, frame_gain: false };
    let (record, maps) = Photometry::find(&dark, &flat, (ROWS, COLUMNS), options).unwrap();
    assert_eq!((&record.dark, &record.flat_field), (&Outcome::SwitchedOff, &Outcome::SwitchedOff));
    assert_eq!(record.correction(&maps).unwrap(), Correction::default());
    let error = Photometry::find(&dark, &flat, (ROWS, 20), options).unwrap_err();
    assert!(matches!(error, PhotometryError::Shapes { what: "dark", index: 0, .. }), "{error}");
}
