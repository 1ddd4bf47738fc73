//! Whether a sequence that is being written is still the one that was begun.

use std::fs;
use std::io;

use super::error::SequenceError;
use super::reader::JOURNAL;
use super::writer::{SequenceWriter, TAKE_AGAIN};
use crate::storage::{if_there, is_same};

impl SequenceWriter {
    /// Refuses a folder or a journal that is not the one that was begun. A disk that does not tell is an error of
    /// its own: what is there may be whole.
    pub(super) fn check(&self) -> Result<(), SequenceError> {
        let folder = self.folder.whereabouts().map_err(SequenceError::io("look at", self.folder.name()))?;
        if folder.is_none() {
            let what = "the folder was removed or replaced".to_owned();
            return Err(self.disturbed(what, "nothing was written in its place; take the scan again"));
        }
        let is_as_left = || -> io::Result<bool> {
            let own = self.journal.metadata()?;
            let found = if_there(fs::symlink_metadata(self.folder.path().join(JOURNAL)))?;
            let lengths = self.journal_bytes..=self.journal_bytes + self.torn_bytes;
            Ok(found.is_some_and(|found| is_same(&own, &found) && lengths.contains(&found.len())))
        };
        if !is_as_left().map_err(SequenceError::io("look at", self.folder.name().join(JOURNAL)))? {
            let what = format!("{JOURNAL} was removed, replaced or changed");
            return Err(self.disturbed(what, "restore it from a copy, or take the scan again"));
        }
        Ok(())
    }

    /// Refuses a sequence without a file that its journal names.
    pub(super) fn check_frames(&self) -> Result<(), SequenceError> {
        let root = self.folder.path();
        let mut gone = Vec::new();
        for ((kind, index), bytes) in &self.named {
            let name = kind.file(*index);
            let found = if_there(fs::symlink_metadata(root.join(&name)));
            let found = found.map_err(SequenceError::io("look at", self.folder.name().join(&name)))?;
            if !found.is_some_and(|found| found.is_file() && found.len() == *bytes) {
                gone.push(name);
            }
        }
        let Some(first) = gone.first() else { return Ok(()) };
        let what = match gone.len() - 1 {
            0 => format!("{first} was removed or changed"),
            others => format!("{first} and {others} more were removed or changed"),
        };
        Err(self.disturbed(what, TAKE_AGAIN))
    }

    pub(super) fn disturbed(&self, what: String, advice: &'static str) -> SequenceError {
        let folder = self.folder.whereabouts_or_name();
        SequenceError::Disturbed { folder, what, advice }
    }

    /// The error of writing the file `name`, or what another program did before.
    pub(super) fn or_disturbed(&self, written: io::Result<()>, name: &str) -> Result<(), SequenceError> {
        let failed = |error| match self.check() {
            Err(disturbed @ SequenceError::Disturbed { .. }) => disturbed,
            _ => SequenceError::io("write", self.folder.name().join(name))(error),
        };
        written.map_err(failed)
    }
}
