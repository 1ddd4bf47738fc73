//! Frames of a sequence in memory, as they are matched.

use tracing::{info, info_span};

use super::error::PipelineError;
use super::packed::packed_volume;
use crate::calibrate::{Calibration, load_calibrated};
use epirig_calibration::photometry::Maps;
use epirig_core::progress::Progress;
use epirig_core::volume::Volume;
use epirig_data::packed::PackedVolume;
use epirig_data::sequence::{Sequence, load_volume};

/// The volume of `sequence`: with a calibration corrected, rectified and with measured positions; else as
/// captured. Where it is [packed](super::pack_sequence), that is read: the samples are the same.
///
/// # Errors
/// [`PipelineError`] naming the frame that cannot be used.
pub fn load(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    progress: &dyn Progress,
) -> Result<Volume, PipelineError> {
    let _span = info_span!("reading", rectified = calibration.is_some()).entered();
    let volume = match packed_volume(sequence, calibration, progress)? {
        Some(packed) => load_packed(&packed, progress)?,
        None => load_unpacked(sequence, calibration, progress)?,
    };
    let (frames, rows, columns) = (volume.frames(), volume.rows(), volume.columns());
    info!(folder = %sequence.folder().display(), frames, rows, columns, "frames read");
    Ok(volume)
}

pub(super) fn load_packed(packed: &PackedVolume, progress: &dyn Progress) -> Result<Volume, PipelineError> {
    progress.begin("reading the packed volume", packed.shape().tau.frames() as u64);
    let volume = packed.rows(0..packed.shape().rows, progress)?;
    progress.end();
    Ok(volume)
}

pub(super) fn load_unpacked(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    progress: &dyn Progress,
) -> Result<Volume, PipelineError> {
    match calibration {
        Some((calibration, maps)) => Ok(load_calibrated(sequence, calibration, maps, progress)?),
        None => Ok(load_volume(sequence, progress)?),
    }
}
