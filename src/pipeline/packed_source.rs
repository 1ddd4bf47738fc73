//! A packed volume as the matcher reads it, and the frames of a sequence as what evaluates matches reads them.

use std::sync::Arc;

use super::error::PipelineError;
use super::load::{load_packed, load_unpacked};
use super::need::Held;
use super::packed::packed_volume;
use crate::calibrate::Calibration;
use epirig_calibration::photometry::Maps;
use epirig_core::fault::Fault as _;
use epirig_core::progress::{Progress, Uncounted};
use epirig_core::tau::Tau;
use epirig_core::volume::{Volume, VolumeShape};
use epirig_data::packed::{PackedError, PackedVolume};
use epirig_data::sequence::Sequence;
use epirig_matcher::{Blocks, MatchError, MatchOptions, RowSource};

/// A packed volume, of which rows are read when they are needed.
#[derive(Debug)]
pub(super) struct PackedSource(pub(super) PackedVolume);

impl RowSource for PackedSource {
    fn shape(&self) -> VolumeShape {
        self.0.shape().clone()
    }

    fn rows(
        &self,
        rows: &[usize],
        frames: &[usize],
        tau: Tau,
        progress: &dyn Progress,
    ) -> Result<Volume, MatchError> {
        self.0.some_rows(rows, frames, tau, &Uncounted(progress)).map_err(|error| match error {
            PackedError::Cancelled(_) => MatchError::Cancelled,
            error => MatchError::Unread { message: error.message(), blame: error.blame() },
        })
    }
}

/// Where [`frames_to_match`] finds the frames of `sequence`.
///
/// # Errors
/// [`PipelineError`] if there is a packed volume that contradicts itself.
pub fn where_frames_are(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<Held, PipelineError> {
    Ok(match packed_volume(sequence, calibration, progress)? {
        Some(packed) if is_left_on_disk(&packed, options)? => Held::Packed,
        _ => Held::InMemory,
    })
}

/// Whether a match needs several blocks.
fn is_left_on_disk(packed: &PackedVolume, options: &MatchOptions) -> Result<bool, MatchError> {
    Ok(!Blocks::new(packed.shape(), options.clone())?.needs_all_rows())
}

/// The frames of `sequence`, for matches with these `options`: packed ones of several blocks of rows stay on disk, others
/// are in memory.
///
/// # Errors
/// [`PipelineError`] naming the frame that cannot be used.
pub fn frames_to_match(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<Arc<dyn RowSource>, PipelineError> {
    Ok(match packed_volume(sequence, calibration, progress)? {
        Some(packed) if is_left_on_disk(&packed, options)? => Arc::new(PackedSource(packed)),
        Some(packed) => Arc::new(load_packed(&packed, progress)?),
        None => Arc::new(load_unpacked(sequence, calibration, progress)?),
    })
}
