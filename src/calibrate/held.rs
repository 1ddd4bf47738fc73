//! The rectified frames that a calibration looks at several times: in memory, or on disk while it lasts.

use super::{CalibrateError, MatchedFrames};
use epirig_core::progress::Progress;
use epirig_core::rows::RowSource;
use epirig_core::volume::Volume;
use epirig_data::packed::{PackWriter, PackedRecord, PackedVolume};
use epirig_data::sequence::Sequence;
use epirig_data::storage::Scratch;

/// Name of the packed frames in their folder.
const PACKED: &str = "frames.zarr";

/// Rectified frames.
pub(super) enum HeldFrames {
    InMemory(Volume),
    OnDisk {
        packed: PackedVolume,
        /// Its folder, which is removed with it.
        _scratch: Scratch,
    },
}

impl HeldFrames {
    /// Rectifies `frames`, and holds them in the folder of their `sequence` if they are more than memory should hold.
    pub(super) fn of(
        frames: &MatchedFrames<'_>,
        sequence: &Sequence,
        on_disk: bool,
        progress: &dyn Progress,
    ) -> Result<Self, CalibrateError> {
        if !on_disk {
            return Ok(Self::InMemory(frames.loaded(progress)?));
        }
        let parent = sequence.folder();
        let scratch = Scratch::inside(parent).map_err(|source| CalibrateError::Io {
            action: "make a folder in",
            path: parent.to_owned(),
            source,
        })?;
        let folder = scratch.path().join(PACKED);
        let (uid, hash) = (sequence.record().uid.clone(), String::new());
        let record = PackedRecord::new(uid, hash, None, frames.shape());
        frames.packed(PackWriter::begin(&folder, record, frames.shape())?, "rectifying frames", progress)?;
        Ok(Self::OnDisk { packed: PackedVolume::open(&folder)?, _scratch: scratch })
    }

    pub(super) fn source(&self) -> &dyn RowSource {
        match self {
            Self::InMemory(volume) => volume,
            Self::OnDisk { packed, .. } => packed,
        }
    }

    /// Equalises the brightness of all frames, whose gains these are.
    pub(super) fn set_gains(&mut self, gains: &[f64]) {
        let factors = gains.iter().map(|gain| (1.0 / gain) as f32);
        match self {
            Self::InMemory(volume) => {
                factors.enumerate().for_each(|(frame, factor)| volume.set_frame_gain(frame, factor));
            }
            Self::OnDisk { packed, .. } => packed.set_frame_gains(factors.collect()),
        }
    }
}
