//! The volume of a sequence on disk, of which rows are read without the rest.

use std::path::Path;

use super::PipelineError;
use crate::calibrate::{Calibration, InputHashes, MatchedFrames, matched_shape};
use epirig_calibration::photometry::Maps;
use epirig_core::progress::Progress;
use epirig_core::volume::VolumeShape;
use epirig_data::packed::{PackWriter, PackedRecord, PackedVolume};
use epirig_data::sequence::Sequence;
use epirig_data::storage::is_there;

/// Name of the packed volume in the folder of its sequence.
pub const PACKED: &str = "volume.zarr";

/// What was packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Packed {
    /// Number of frames.
    pub frames: usize,
    /// Rows of a frame.
    pub rows: usize,
    /// Columns of a frame.
    pub columns: usize,
    /// Bits of a stored sample: 16 for rectified frames.
    pub bit_depth: u8,
    /// Frames that an earlier run had packed already.
    pub packed_before: usize,
}

/// Packs the frames of `sequence` into the volume `out`, as they are matched: with a calibration corrected and
/// rectified, else as captured. A few of them are in memory at a time. A volume that was begun is completed.
///
/// # Errors
/// [`PipelineError`] naming the frame that cannot be used, or the file that cannot be written. What is packed by
/// then stays.
pub fn pack_sequence(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Packed, PipelineError> {
    let frames = MatchedFrames::of(sequence, calibration.map(|(calibration, maps)| (calibration, maps)))?;
    let (shape, count) = (frames.shape(), frames.records().len());
    let record = record(sequence, calibration.map(|(calibration, _)| calibration), shape);
    let packed = Packed {
        frames: count,
        rows: shape.rows,
        columns: shape.columns,
        bit_depth: shape.stored_bit_depth(),
        packed_before: count,
    };
    if PackedVolume::record_of(out).is_ok_and(|found| found == record) {
        return Ok(packed);
    }
    let writer = PackWriter::begin(out, record, shape)?;
    Ok(Packed { packed_before: frames.packed(writer, "packing frames", progress)?, ..packed })
}

/// The packed volume in the folder of `sequence`, if it is whole and made of these frames by this calibration. One
/// that is of others, or not whole, is told to `progress` and not used.
///
/// # Errors
/// [`PipelineError`] if it contradicts itself.
pub fn packed_volume(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    progress: &dyn Progress,
) -> Result<Option<PackedVolume>, PipelineError> {
    let folder = sequence.folder().join(PACKED);
    if !is_there(&folder).unwrap_or(false) {
        return Ok(None);
    }
    let calibration = calibration.map(|(calibration, _)| calibration);
    let expected = record(sequence, calibration, &matched_shape(sequence, calibration)?);
    let reason = match PackedVolume::record_of(&folder) {
        Ok(found) if found == expected => return Ok(Some(PackedVolume::open(&folder)?)),
        Ok(found) if found.calibration.is_some() && calibration.is_none() => "it holds rectified frames",
        Ok(found) if found.frames_blake3 == expected.frames_blake3 => "it is of another calibration",
        Ok(_) => "it is of other frames",
        Err(_) => "it is not whole",
    };
    progress.note(&format!("{} is not used: {reason}; `epirig pack` makes it anew", folder.display()));
    Ok(None)
}

fn record(sequence: &Sequence, calibration: Option<&Calibration>, shape: &VolumeShape) -> PackedRecord {
    let frames = InputHashes::of(sequence).frames;
    PackedRecord::new(sequence.record().uid.clone(), frames, calibration.map(Calibration::hash), shape)
}
