//! What is known of a rig before its frames are looked at: from its profile.

use super::Options;
use crate::calibrate::{CalibrationPlan, LensKnowledge, PositionSource};
use crate::profile::{BoardProfile, FocalLength, PrintProfile, Profile};
use epirig_calibration::lens::Distortion;
use epirig_calibration::photometry::PhotometryOptions;
use epirig_calibration::target::{ChessBoard, Target};

/// Target, board and lens as `profile` describes them, for frames of `columns` x `rows`.
pub(in crate::cli) fn calibration_plan(profile: &Profile, columns: usize, rows: usize) -> CalibrationPlan {
    let optics = &profile.optics;
    CalibrationPlan {
        target: profile.target.print.map(target),
        board: profile.board.map(board),
        lens: optics
            .lens(columns, rows)
            .map(|lens| LensKnowledge::DataSheet { lens, focal_length_sigma: optics.focal_length_sigma }),
        photometry: PhotometryOptions::default(),
        positions: PositionSource::Automatic,
        exposures: Vec::new(),
    }
}

/// What a recorded profile says of lens, target and board, so that the command line can change it.
pub(in crate::cli) fn recorded_options(profile: &Profile) -> Options {
    let mut options = Options::default();
    let mut add = |key: &str, value: Option<f64>| options.add(key, "sequence.json", value);
    let optics = &profile.optics;
    match optics.focal_length {
        Some(FocalLength::Px(px)) => add("optics.focal_length_px", Some(px)),
        Some(FocalLength::Mm(mm)) => add("optics.focal_length_mm", Some(mm)),
        None => {}
    }
    add("optics.sensor_width_mm", optics.sensor_width_mm);
    add("optics.principal_point_x_px", optics.principal_point_px.map(|point| point.0));
    add("optics.principal_point_y_px", optics.principal_point_px.map(|point| point.1));
    let Distortion { k1, k2, p1, p2, k3 } = optics.distortion;
    for (name, value) in [("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2), ("k3", k3)] {
        add(&format!("optics.{name}"), (value != 0.0).then_some(value));
    }
    // It means nothing without a focal length, and a profile that says it alone is refused.
    let sigma_percent = optics.focal_length.map(|_| format!("{} %", 100.0 * optics.focal_length_sigma));
    options.add("optics.focal_length_sigma", "sequence.json", sigma_percent);
    let mut add_board = |section: &str, board: BoardProfile| {
        options.add(&format!("{section}.square_mm"), "sequence.json", Some(board.square_mm));
        options.add(&format!("{section}.columns"), "sequence.json", Some(board.columns));
        options.add(&format!("{section}.rows"), "sequence.json", Some(board.rows));
    };
    if let Some(board) = profile.board {
        add_board("board", board);
    }
    if let Some(print) = profile.target.print {
        add_board("target", print.board);
        options.add("target.bands", "sequence.json", print.band_distance_mm.map(|_| 2));
        options.add("target.band_distance_mm", "sequence.json", print.band_distance_mm);
    }
    options
}

/// Whether a scan with this profile brings anything that tells more than the profile itself.
pub(in crate::cli) fn can_be_calibrated(profile: &Profile) -> bool {
    let plan = &profile.plan;
    plan.dark + plan.flat + plan.board > 0 || profile.target.print.is_some()
}

fn board(board: BoardProfile) -> ChessBoard {
    ChessBoard { columns: board.columns, rows: board.rows, square_mm: board.square_mm }
}

fn target(print: PrintProfile) -> Target {
    Target {
        board: board(print.board),
        bands: if print.band_distance_mm.is_some() { 2 } else { 1 },
        band_distance_mm: print.band_distance_mm.unwrap_or(0.0),
    }
}
