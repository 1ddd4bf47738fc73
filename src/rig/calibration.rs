//! The profile's knowledge of a rig, as a calibration plan.

use crate::calibrate::{CalibrationPlan, LensKnowledge, PositionSource};
use crate::profile::{BoardProfile, PrintProfile, Profile};
use epirig_calibration::photometry::PhotometryOptions;
use epirig_calibration::target::{ChessBoard, Target};

/// Target, board and lens as described by `profile`, for frames of `columns` x `rows`.
pub fn calibration_plan(profile: &Profile, columns: usize, rows: usize) -> CalibrationPlan {
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

/// Whether a scan with this profile gives anything to calibrate with.
pub fn can_be_calibrated(profile: &Profile) -> bool {
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
