//! The figures of a synthetic calibration with known content.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::calibration_figures;
use crate::calibrate::{
    Calibrated, Calibration, FORMAT_VERSION, InputHashes, LensRecord, LensSource, PositionSource,
    PositionsRecord,
};
use crate::report::Figure;
use epirig_calibration::lens::views::{Coverage, LensCalibration, PointName, PointResidual, Terms, ViewFit};
use epirig_calibration::lens::{Lens, LensEstimate};
use epirig_calibration::photometry::{
    FlatField, FlatMethod, FlatModel, FrameGains, Maps, Outcome, Photometry, PhotometryOptions, Polynomial,
};
use epirig_calibration::rectification::Mapping;
use epirig_calibration::stage_axis::{Direction, FramePosition, PositioningError, StageAxis, TrackResidual};

const ROWS: usize = 480;
const COLUMNS: usize = 640;
const FRAMES: usize = 60;

fn noise(random: &mut ChaCha8Rng) -> f64 {
    random.sample(StandardNormal)
}

fn flat_field(random: &mut ChaCha8Rng) -> FlatField {
    let polynomial = Polynomial::new(ROWS, COLUMNS, vec![1.1, 0.02, 0.0, -0.15, 0.0, -0.12]).unwrap();
    let mean = polynomial.mean();
    let polynomial = polynomial.scaled(1.0 / mean);
    let residual_percent = (0..10).map(|_| (0..10).map(|_| 0.05 * noise(random)).collect()).collect();
    FlatField {
        method: FlatMethod::Automatic,
        model: FlatModel::Polynomial(polynomial),
        frames: 8,
        residual_percent,
        residual_rms_percent: 0.05,
        vignetting_percent: 24.0,
        trials: Vec::new(),
        sigma_percent: Some(0.01),
        outliers: Vec::new(),
    }
}

/// Boards of 9 x 6 in twelve places, none of them in the right tenth of the frame; one point is 3 px off.
fn lens(random: &mut ChaCha8Rng) -> LensCalibration {
    let mut residuals: Vec<Vec<PointResidual>> = (0..12_usize)
        .map(|view| {
            let (left, top) = ((view % 4) as f64 * 100.0 + 10.0, (view / 4) as f64 * 120.0 + 5.0);
            (0..54_usize)
                .map(|point| PointResidual {
                    x_px: left + 28.0 * (point % 9) as f64,
                    y_px: top + 32.0 * (point / 9) as f64 + 3.0 * (point % 9) as f64,
                    dx_px: 0.02 * noise(random),
                    dy_px: 0.02 * noise(random),
                    rejected: false,
                })
                .collect()
        })
        .collect();
    residuals[1][5] = PointResidual { dx_px: -3.0, rejected: true, ..residuals[1][5] };
    LensCalibration {
        estimate: LensEstimate::independent(ROWS, COLUMNS, Lens::pinhole(1000.0, 319.5, 239.5), [0.0; 9]),
        terms: Terms::K1,
        rms_px: 0.028,
        variance_factor: 1.0,
        residuals,
        poses: Vec::new(),
        views: vec![ViewFit { rms_px: 0.028, points: 54, rejected: 0 }; 12],
        coverage: Coverage { cells: 0.81, radius: 0.85 },
        rejected: vec![PointName { view: 1, point: 5 }],
        cross_validation: Vec::new(),
        warnings: Vec::new(),
    }
}

/// Rows with a bow of 0.01 px in the middle.
fn stage_axis(random: &mut ChaCha8Rng) -> StageAxis {
    let residuals = (0..FRAMES * 80).map(|index| {
        let column_px = random.random_range(-300.0..300.0);
        let bend = 0.01 * (1.0 - (column_px / 200.0_f64).powi(2));
        let across_px = bend + 0.02 * noise(random);
        TrackResidual { frame: index / 80, corner: index % 80, column_px, along_px: 0.0, across_px }
    });
    StageAxis {
        direction: Direction::default(),
        roll_sigma_rad: 0.0,
        pan_sigma_rad: 0.0,
        lens: lens(&mut ChaCha8Rng::seed_from_u64(2)).estimate,
        tau: Vec::new(),
        residuals: residuals.collect(),
        points: Vec::new(),
        rejected: Vec::new(),
        noise_factor: 1.0,
    }
}

/// A stage with errors of a few um, 40 um in frame 57, and no measurement in frame 20.
fn positioning_error(random: &mut ChaCha8Rng) -> PositioningError {
    let frames = (0..FRAMES).map(|frame| {
        let reported_mm = 1.5 * frame as f64;
        let error_um = if frame == 57 { 40.0 } else { 3.0 * noise(random) };
        let seen = frame != 20;
        FramePosition {
            reported_mm,
            measured_mm: if seen { reported_mm + 0.001 * error_um } else { reported_mm },
            sigma_mm: seen.then_some(0.001),
        }
    });
    PositioningError {
        frames: frames.collect(),
        rms_um: 6.0,
        largest_um: 40.0,
        outliers: vec![57],
        baseline_mm: 88.5,
        baseline_sigma_mm: 0.001,
    }
}

pub(in crate::report) fn bare() -> Calibrated {
    let estimate = LensEstimate::independent(ROWS, COLUMNS, Lens::pinhole(1000.0, 319.5, 239.5), [0.0; 9]);
    let mapping = Mapping::fitting(estimate.lens, 0.0, 0.0, ROWS, COLUMNS).unwrap();
    let nothing = String::new;
    let calibration = Calibration {
        blake3: String::new(),
        scan_ended: String::new(),
        format: FORMAT_VERSION,
        program: nothing(),
        sequence_uid: nothing(),
        inputs: InputHashes {
            frames: nothing(),
            dark: nothing(),
            flat: nothing(),
            board: nothing(),
            counts: [0; 4],
        },
        photometry: Photometry {
            rows: ROWS,
            columns: COLUMNS,
            options: PhotometryOptions::default(),
            dark: Outcome::SwitchedOff,
            flat_field: Outcome::NotApplied(nothing()),
            defective_pixels: Outcome::SwitchedOff,
        },
        linearity: None,
        maps: Default::default(),
        frame_gains: Outcome::SwitchedOff,
        lens: LensRecord {
            source: LensSource::Unknown,
            file: None,
            estimate,
            board_frames: None,
            board_files: Vec::new(),
            corners_of_board: 0,
        },
        stage_axis: None,
        camera_motion: None,
        positions: PositionsRecord {
            order: Vec::new(),
            source: PositionSource::Stage,
            tau: Vec::new(),
            tau_sigma: Vec::new(),
            baseline_mm: None,
            baseline_sigma_mm: None,
            positioning_error: None,
            target_scale: None,
        },
        mapping,
        notes: Vec::new(),
        needs: Vec::new(),
    };
    Calibrated { calibration, maps: Maps::default(), stage_axis: None }
}

fn complete() -> Calibrated {
    let random = &mut ChaCha8Rng::seed_from_u64(1);
    let mut found = bare();
    found.calibration.photometry.flat_field = Outcome::Applied(flat_field(random));
    let gain: Vec<f64> = (0..FRAMES).map(|frame| 1.0 + 0.002 * (0.5 * frame as f64).sin()).collect();
    found.calibration.frame_gains = Outcome::Applied(FrameGains {
        sigma: vec![0.000_25; FRAMES],
        gain,
        flicker: 0.0014,
        significant: true,
        windows: 90,
        disparity_px: -120.0,
    });
    found.calibration.lens.board_frames = Some(lens(random));
    found.calibration.positions.positioning_error = Some(positioning_error(random));
    found.stage_axis = Some(stage_axis(random));
    found
}

fn figure<'a>(figures: &'a [Figure], name: &str) -> &'a Figure {
    figures.iter().find(|figure| figure.name == name).unwrap()
}

/// Line `index` of a figure's table, the head being 0, as fields.
fn fields(figure: &Figure, index: usize) -> Vec<&str> {
    figure.csv.lines().nth(index).unwrap().split(',').collect()
}

/// Pixels of one colour.
fn count(figure: &Figure, colour: [u8; 3]) -> usize {
    figure.picture.pixels().filter(|pixel| pixel.0 == colour).count()
}

const BLUE: [u8; 3] = [0, 114, 178];
const VERMILION: [u8; 3] = [213, 94, 0];

#[test]
fn every_part_has_its_figure_and_what_was_not_found_has_none() {
    let figures = calibration_figures(&complete()).unwrap();
    let names: Vec<&str> = figures.iter().map(|figure| figure.name).collect();
    let all =
        ["flat-field", "flat-field-residuals", "frame-gains", "lens-residuals", "lens-coverage", "rows"];
    assert_eq!(names, [&all[..], &["positioning-error"]].concat());
    assert_eq!(calibration_figures(&bare()).unwrap(), Vec::new());
    let mut without_map = bare();
    let random = &mut ChaCha8Rng::seed_from_u64(1);
    let field = FlatField { model: FlatModel::PerPixel, residual_percent: Vec::new(), ..flat_field(random) };
    without_map.calibration.photometry.flat_field = Outcome::Applied(field);
    assert_eq!(calibration_figures(&without_map).unwrap(), Vec::new());
}

#[test]
fn the_flat_field_is_told_in_percent_of_its_mean() {
    let figures = calibration_figures(&complete()).unwrap();
    let field = figure(&figures, "flat-field");
    assert_eq!(field.csv.lines().count(), 101);
    assert_eq!(fields(field, 1)[..4], ["0", "63", "0", "47"]);
    // 1.1 + 0.02 u - 0.15 u2 - 0.12 v2 has the mean 1.1 - 0.09 but for terms of 1 / size; over the first
    // cell, u and v from -1 to -0.8, the means of u, u2 and v2 are -0.9, 0.8133 and 0.8133.
    let expected = 100.0 * (1.1 - 0.018 - 0.27 * 0.8133) / 1.01;
    let first: f64 = fields(field, 1)[4].parse().unwrap();
    assert!((first - expected).abs() < 0.3, "{first} {expected}");
    let residuals = figure(&figures, "flat-field-residuals");
    assert_eq!((residuals.csv.lines().count(), fields(residuals, 0)[2]), (101, "residual_percent"));
}

#[test]
fn gains_of_frames_are_shown_with_their_standard_deviations() {
    let figures = calibration_figures(&complete()).unwrap();
    let gains = figure(&figures, "frame-gains");
    assert_eq!(fields(gains, 1), ["0", "1", "0.00025"]);
    // Each of the dots covers 13 pixels at least.
    assert!(count(gains, BLUE) > 13 * FRAMES);
}

#[test]
fn residuals_of_the_lens_are_magnified_and_rejected_ones_stand_out() {
    let figures = calibration_figures(&complete()).unwrap();
    let residuals = figure(&figures, "lens-residuals");
    assert_eq!(residuals.csv.lines().count(), 1 + 12 * 54);
    let rejected = fields(residuals, 1 + 54 + 5);
    assert_eq!((&rejected[..2], &rejected[4..5], rejected[6]), (&["1", "5"][..], &["-3"][..], "true"));
    assert!(count(residuals, VERMILION) > 60);
    let mut without = complete();
    if let Some(lens) = &mut without.calibration.lens.board_frames {
        lens.residuals.iter_mut().flatten().for_each(|point| point.rejected = false);
    }
    assert_eq!(count(figure(&calibration_figures(&without).unwrap(), "lens-residuals"), VERMILION), 0);
}

#[test]
fn coverage_counts_corners_and_shows_where_none_are() {
    let figures = calibration_figures(&complete()).unwrap();
    let coverage = figure(&figures, "lens-coverage");
    let counts: Vec<usize> = (1..=100).map(|line| fields(coverage, line)[2].parse().unwrap()).collect();
    assert_eq!(counts.iter().sum::<usize>(), 12 * 54 - 1);
    // The last corner of the rightmost boards is at column 534 of 640, in the ninth cell.
    assert!(counts.iter().enumerate().all(|(index, count)| index % 10 < 9 || *count == 0));
    // 10 empty cells of 80 x 60 px at least, less their numbers.
    assert!(count(coverage, [205, 205, 205]) > 10 * 80 * 60 * 9 / 10);
}

#[test]
fn rows_tell_every_corner_and_the_mean_follows_the_bend() {
    let figures = calibration_figures(&complete()).unwrap();
    let rows = figure(&figures, "rows");
    assert_eq!(rows.csv.lines().count(), 1 + FRAMES * 80);
    let stage_axis = complete().stage_axis.unwrap();
    let (first, residual) = (fields(rows, 1), stage_axis.residuals[0]);
    // The principal point is at 319.5.
    assert!((first[2].parse::<f64>().unwrap() - (residual.column_px + 319.5)).abs() < 1e-9);
    assert_eq!(first[4].parse::<f64>().unwrap(), residual.across_px);
    // The line crosses the picture.
    let columns = |x: u32| (60..400).any(|y| rows.picture.get_pixel(x, y).0 == VERMILION);
    assert!((120..920).filter(|&x| columns(x)).count() > 750);
}

#[test]
fn the_positioning_error_names_the_frame_that_stands_out() {
    let figures = calibration_figures(&complete()).unwrap();
    let positioning = figure(&figures, "positioning-error");
    let outlier = fields(positioning, 58);
    assert_eq!((outlier[0], outlier[5]), ("57", "true"));
    assert!((outlier[3].parse::<f64>().unwrap() - 40.0).abs() < 1e-6);
    assert_eq!(fields(positioning, 21), ["20", "30", "nan", "nan", "nan", "false"]);
    // The dot, its bar and its name, near the right end below the legend.
    let place = |x: u32, y: u32| x > 800 && y > 60;
    let pixels =
        positioning.picture.enumerate_pixels().filter(|(x, y, pixel)| place(*x, *y) && pixel.0 == VERMILION);
    assert!(pixels.count() > 40);
}
