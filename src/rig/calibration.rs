//! The profile's knowledge of a rig, as a calibration plan.

use crate::calibrate::{CalibrationPlan, LensKnowledge, PositionSource};
use crate::profile::Profile;
use epirig_calibration::photometry::PhotometryOptions;

/// Target, board and lens as described by `profile`, for frames of `columns` x `rows`.
pub fn calibration_plan(profile: &Profile, columns: usize, rows: usize) -> CalibrationPlan {
    let optics = &profile.optics;
    CalibrationPlan {
        target: profile.target.print(),
        board: profile.board.chess_board(),
        lens: optics
            .lens(columns, rows)
            .map(|lens| LensKnowledge::DataSheet { lens, focal_length_sigma: optics.focal_length_sigma }),
        photometry: PhotometryOptions::default(),
        positions: PositionSource::Automatic,
        exposures: Vec::new(),
        frames_on_disk: false,
    }
}

/// Whether a scan with this profile gives anything to calibrate with.
pub fn can_be_calibrated(profile: &Profile) -> bool {
    let plan = &profile.plan;
    plan.dark + plan.flat + plan.board > 0 || profile.target.print().is_some()
}
