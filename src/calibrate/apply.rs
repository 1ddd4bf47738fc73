//! What corrects and rectifies raw frames, as a calibration describes.

use super::{CALIBRATION, CalibrateError, Calibration};
use epirig_calibration::photometry::Maps;
use epirig_calibration::rectification::Rectifier;
use epirig_data::sequence::Sequence;

/// What corrects and rectifies the frames of `sequence`, one by one.
///
/// # Errors
/// [`CalibrateError::BadRecord`] if the calibration does not match the frames.
pub fn rectifier(
    sequence: &Sequence,
    calibration: &Calibration,
    maps: &Maps,
) -> Result<Rectifier, CalibrateError> {
    let bad = |error| fault_of_the_record(sequence, error);
    let correction = calibration.photometry.correction(maps).map_err(|error| bad(error.into()))?;
    let rectifier = match calibration.has_motion() {
        true => Rectifier::with_poses(calibration.mapping, correction, calibration.poses()),
        false => Rectifier::new(calibration.mapping, correction),
    };
    rectifier.map_err(|error| bad(error.into()))
}

/// The frames passed when the calibration was made, so a rejection now is a fault of the record.
pub(super) fn fault_of_the_record(sequence: &Sequence, error: CalibrateError) -> CalibrateError {
    match error {
        CalibrateError::Photometry(_) | CalibrateError::Positions(_) | CalibrateError::Rectify(_) => {
            CalibrateError::BadRecord { path: sequence.folder().join(CALIBRATION), reason: error.to_string() }
        }
        other => other,
    }
}
