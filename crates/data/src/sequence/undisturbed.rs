//! Whether a sequence that is being written is still the one that was begun.

use std::fs;

use super::error::SequenceError;
use super::reader::JOURNAL;
use super::writer::{SequenceWriter, TAKE_AGAIN};
use crate::storage::is_same;

impl SequenceWriter {
    /// Refuses a folder or a journal that is not the one that was begun.
    pub(super) fn check(&self) -> Result<(), SequenceError> {
        if self.folder.whereabouts().is_none() {
            let what = "the folder was removed or replaced".to_owned();
            return Err(self.disturbed(what, "nothing was written in its place; take the scan again"));
        }
        let path = self.folder.path().join(JOURNAL);
        let own = self.journal.metadata();
        let is_as_left = fs::symlink_metadata(path).is_ok_and(|found| {
            own.is_ok_and(|own| is_same(&own, &found) && found.len() == self.journal_bytes)
        });
        if !is_as_left {
            let what = format!("{JOURNAL} was removed, replaced or changed");
            return Err(self.disturbed(what, "restore it from a copy, or take the scan again"));
        }
        Ok(())
    }

    /// Refuses a sequence without a file that its journal names.
    pub(super) fn check_frames(&self) -> Result<(), SequenceError> {
        let root = self.folder.path();
        let is_there = |name: &str, bytes: u64| {
            fs::symlink_metadata(root.join(name)).is_ok_and(|found| found.is_file() && found.len() == bytes)
        };
        let files = self.named.iter().map(|((kind, index), bytes)| (kind.file(*index), *bytes));
        let gone: Vec<String> =
            files.filter(|(name, bytes)| !is_there(name, *bytes)).map(|(name, _)| name).collect();
        let Some(first) = gone.first() else { return Ok(()) };
        let what = match gone.len() - 1 {
            0 => format!("{first} was removed or changed"),
            others => format!("{first} and {others} more were removed or changed"),
        };
        Err(self.disturbed(what, TAKE_AGAIN))
    }

    pub(super) fn disturbed(&self, what: String, advice: &'static str) -> SequenceError {
        let folder = self.folder.whereabouts().unwrap_or_else(|| self.folder.name().to_owned());
        SequenceError::Disturbed { folder, what, advice }
    }

    /// The error of writing the file `name`, or what another program did before.
    pub(super) fn or_disturbed(&self, written: std::io::Result<()>, name: &str) -> Result<(), SequenceError> {
        let failed = |error| {
            let why = self.check().err();
            why.unwrap_or_else(|| SequenceError::io("write", self.folder.name().join(name))(error))
        };
        written.map_err(failed)
    }
}
