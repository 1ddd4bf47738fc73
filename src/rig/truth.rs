//! The truth of a scan of the simulated rig.

use super::{RigError, simulator};
use crate::calibrate::Calibration;
use epirig_data::sequence::{Origin, Sequence};
use epirig_simulator::{Pinhole, SimulatorError, Truth};

/// What the simulator knows of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanTruth {
    /// Disparity, height and visibility of the pixels of the reference frame.
    pub maps: Truth,
    /// Index of the reference frame.
    pub reference: usize,
    /// Where the carriage truly stood at each frame, in mm from home, with the errors of its screw (`sim.step_error`).
    /// Errors that the stage itself simulates, such as backlash, noise or lost steps, are not known.
    pub positions_mm: Vec<f64>,
    /// The same on the baseline, from 0 to 1.
    pub tau: Vec<f64>,
}

/// The truth of `sequence` for the pixels of frame `reference`; without it, of the frame nearest to the middle of the
/// baseline. With a calibration, its rectified camera sees it, else that of the simulator.
///
/// # Errors
/// [`RigError::NotSimulated`] if the scan was not simulated; [`RigError::IncompleteScan`] if frames are missing;
/// [`RigError::NotCalibrated`] if the camera is turned or distorts, and there is no calibration;
/// [`RigError::Simulator`] if there is no such frame.
pub fn scan_truth(
    sequence: &Sequence,
    calibration: Option<&Calibration>,
    reference: Option<usize>,
) -> Result<ScanTruth, RigError> {
    let not_simulated = || RigError::NotSimulated(sequence.folder().to_owned());
    let Origin::Captured { simulator: Some(config), .. } = &sequence.record().origin else {
        return Err(not_simulated());
    };
    let config = serde_json::from_value(config.clone()).map_err(|_| not_simulated())?;
    let simulator = simulator(config)?;
    let (frames, planned) = (sequence.frames().len(), simulator.config().scan.frames);
    if frames != planned {
        return Err(RigError::IncompleteScan { folder: sequence.folder().to_owned(), frames, planned });
    }
    let tau = simulator.true_tau();
    let reference = reference.unwrap_or_else(|| tau.middle_frame());
    let maps = match calibration {
        None => simulator.truth(reference).map_err(|error| match error {
            SimulatorError::NotRectified => RigError::NotCalibrated(sequence.folder().to_owned()),
            error => error.into(),
        })?,
        Some(calibration) => {
            let camera = &calibration.mapping.camera;
            let pinhole = Pinhole {
                rows: camera.rows,
                columns: camera.columns,
                focal_length_px: camera.focal_length_px,
                principal_point_x_px: camera.principal_point_x_px,
                principal_point_y_px: camera.principal_point_y_px,
            };
            simulator.truth_seen_by(&pinhole, reference)?
        }
    };
    let reported_mm = simulator.config().scan.positions_mm();
    let positions_mm = reported_mm.iter().map(|mm| simulator.true_position_mm(*mm)).collect();
    Ok(ScanTruth { maps, reference, positions_mm, tau: tau.values().to_vec() })
}
