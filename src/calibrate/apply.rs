//! Builds the volume from raw frames, as a calibration describes.

use super::frames::{frames_in_order, load, set_gains};
use super::{CALIBRATION, CalibrateError, Calibration};
use epirig_calibration::photometry::Maps;
use epirig_calibration::rectification::Rectifier;
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_data::sequence::Sequence;

/// Reads all frames of `sequence` into a volume: corrected, rectified with one resampling, and with measured
/// tau.
///
/// # Errors
/// [`CalibrateError`] naming the frame that cannot be used, or the part of the calibration that does not
/// match.
pub fn load_calibrated(
    sequence: &Sequence,
    calibration: &Calibration,
    maps: &Maps,
    progress: &dyn Progress,
) -> Result<Volume, CalibrateError> {
    let bad = |error| fault_of_the_record(sequence, error);
    sequence.check_records()?;
    let rectifier = rectifier(sequence, calibration, maps)?;
    let tau = Tau::from_positions(&calibration.positions.tau).map_err(|error| bad(error.into()))?;
    let span = tracing::info_span!("rectification");
    let loaded = span.in_scope(|| {
        load(sequence, &frames_in_order(sequence, Some(calibration)), &rectifier, tau, progress)
    });
    let mut volume = loaded.map_err(bad)?;
    if let Some(gains) = calibration.gains() {
        set_gains(&mut volume, &gains);
    }
    Ok(volume)
}

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
fn fault_of_the_record(sequence: &Sequence, error: CalibrateError) -> CalibrateError {
    match error {
        CalibrateError::Photometry(_) | CalibrateError::Positions(_) | CalibrateError::Rectify(_) => {
            CalibrateError::BadRecord { path: sequence.folder().join(CALIBRATION), reason: error.to_string() }
        }
        other => other,
    }
}
