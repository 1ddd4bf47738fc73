//! From raw frames to the volume, as a calibration says.

use rayon::prelude::*;

use super::find::set_gains;
use super::{CALIBRATION, CalibrateError, Calibration};
use epirig_calibration::photometry::{Correction, Maps};
use epirig_calibration::rectification::{Mapping, Rectifier};
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_data::sequence::Sequence;

/// Reads all frames of `sequence` into a volume, corrected and rectified in one resampling, with measured tau.
///
/// # Errors
/// [`CalibrateError`] naming the frame that cannot be used, or what of the calibration does not fit.
pub fn load_calibrated(
    sequence: &Sequence,
    calibration: &Calibration,
    maps: &Maps,
    progress: &dyn Progress,
) -> Result<Volume, CalibrateError> {
    // The frames were not rejected when the calibration was made, so it is the record that is wrong now.
    let bad = |error: CalibrateError| match error {
        error @ (CalibrateError::Photometry(_)
        | CalibrateError::Positions(_)
        | CalibrateError::Rectify(_)) => {
            CalibrateError::BadRecord { path: sequence.folder().join(CALIBRATION), reason: error.to_string() }
        }
        other => other,
    };
    sequence.check_records()?;
    let correction = calibration.photometry.correction(maps).map_err(|error| bad(error.into()))?;
    let tau = Tau::from_positions(&calibration.positions.tau).map_err(|error| bad(error.into()))?;
    let span = tracing::info_span!("rectification");
    let loaded = span.in_scope(|| load(sequence, &calibration.mapping, correction, tau, progress));
    let mut volume = loaded.map_err(bad)?;
    if let Some(gains) = calibration.frame_gains.applied() {
        set_gains(&mut volume, gains);
    }
    Ok(volume)
}

/// Frames that are read and rectified together: the rectifier's eight lanes.
const TOGETHER: usize = 8;

/// A few frames at a time, so that besides the volume only those are in memory.
pub(super) fn load(
    sequence: &Sequence,
    mapping: &Mapping,
    correction: Correction,
    tau: Tau,
    progress: &dyn Progress,
) -> Result<Volume, CalibrateError> {
    let rectifier = Rectifier::new(*mapping, correction)?;
    let mut volume = rectifier.volume(sequence.record().bit_depth, tau);
    progress.begin("rectifying frames", sequence.frames().len() as u64);
    for (chunk, records) in sequence.frames().chunks(TOGETHER).enumerate() {
        let frames: Result<Vec<_>, _> = records.par_iter().map(|record| sequence.read(record)).collect();
        rectifier.insert(&mut volume, chunk * TOGETHER, &frames?)?;
        progress.advance(records.len() as u64);
    }
    progress.end();
    Ok(volume)
}
