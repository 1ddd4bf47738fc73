//! The profile that a sequence was recorded with.

use std::path::PathBuf;

use thiserror::Error;

use super::settings::Settings;
use super::{Profile, read};
use crate::sequence::Sequence;

/// Why the rig of a sequence cannot be understood.
#[derive(Debug, Error)]
#[error(
    "{}: its rig cannot be understood: {source}; use the program that wrote it ({program}), or restore the file from a copy",
    path.display()
)]
pub struct RecordedRigError {
    /// The start record.
    pub path: PathBuf,
    /// What wrote it.
    pub program: String,
    /// What is wrong.
    pub source: serde_json::Error,
}

impl Profile {
    /// The rig that the frames of `sequence` were taken with: of a scan all of it, of imported images what was said of lens and
    /// targets, with stage, camera and plan as if nothing had been said. `None` if nothing was recorded.
    ///
    /// # Errors
    /// [`RecordedRigError`].
    pub fn of_sequence(sequence: &Sequence) -> Result<Option<Self>, RecordedRigError> {
        let record = sequence.record();
        let profile = record.origin.rig().map(|rig| serde_json::from_value(rig.clone())).transpose();
        profile.map_err(|source| RecordedRigError {
            path: sequence.folder().join("sequence.json"),
            program: record.program.clone(),
            source,
        })
    }

    /// What it says of lens and targets alone: all that images say nothing of is as if it had been left out.
    pub fn of_lens_and_targets(self) -> Self {
        let Self { optics, target, board, .. } = self;
        // Where nothing was given, nothing is wrong.
        let (nothing, _) = read::read(Settings::default());
        Self { optics, target, board, ..nothing }
    }
}
