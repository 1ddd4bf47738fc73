//! Builds the volume from raw frames, as a calibration describes.

use super::matched::MatchedFrames;
use super::{CALIBRATION, CalibrateError, Calibration};
use epirig_calibration::photometry::Maps;
use epirig_calibration::rectification::Rectifier;
use epirig_core::progress::Progress;
use epirig_core::volume::Volume;
use epirig_data::sequence::Sequence;

/// Reads all frames of `sequence` into a volume: corrected, rectified with one resampling, and with measured
/// tau. A few frames at a time are in memory besides the volume.
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
    let frames = MatchedFrames::of(sequence, Some((calibration, maps)))?;
    let _span = tracing::info_span!("rectification").entered();
    let (shape, count) = (frames.shape(), frames.records().len());
    let mut volume = shape.of_rows(shape.rows);
    progress.begin("rectifying frames", count as u64);
    for first in (0..count).step_by(MatchedFrames::TOGETHER) {
        progress.unless_cancelled()?;
        frames.insert(&mut volume, (first, first))?;
        progress.advance(MatchedFrames::TOGETHER.min(count - first) as u64);
    }
    progress.end();
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
pub(super) fn fault_of_the_record(sequence: &Sequence, error: CalibrateError) -> CalibrateError {
    match error {
        CalibrateError::Photometry(_) | CalibrateError::Positions(_) | CalibrateError::Rectify(_) => {
            CalibrateError::BadRecord { path: sequence.folder().join(CALIBRATION), reason: error.to_string() }
        }
        other => other,
    }
}
