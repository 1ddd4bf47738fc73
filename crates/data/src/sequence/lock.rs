//! The lock of a sequence: one program at a time writes it.

use std::fs::{File, TryLockError};
use std::path::Path;

use super::error::SequenceError;
use super::reader::JOURNAL;
use crate::storage::open_file;

/// Opens the journal of a sequence and locks it against other writing programs, if the file system has locks.
///
/// # Errors
/// [`SequenceError::Busy`], or that the journal cannot be opened.
pub fn lock(folder: &Path) -> Result<File, SequenceError> {
    let path = folder.join(JOURNAL);
    let journal = open_file(&path)?;
    match journal.try_lock() {
        Ok(()) | Err(TryLockError::Error(_)) => Ok(journal),
        Err(TryLockError::WouldBlock) => Err(SequenceError::Busy(folder.to_owned())),
    }
}

/// Refuses a sequence that another program writes now.
///
/// # Errors
/// [`SequenceError::Busy`], or that its journal cannot be opened.
pub fn refuse_busy(folder: &Path) -> Result<(), SequenceError> {
    lock(folder).map(drop)
}
