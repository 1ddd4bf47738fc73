//! What was found wrong in a sequence.

use serde::Serialize;

/// Something that is not as recorded, with the file it concerns and what to do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// The file or frame, or the sequence's folder.
    pub file: String,
    /// What is wrong and what to do.
    pub problem: String,
}

impl Finding {
    pub(super) fn new(file: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { file: file.into(), problem: problem.into() }
    }
}

/// What helps against records that contradict each other.
pub(super) const RESTORE: &str = "restore the records from a copy";
