//! Who must act on an error.

use std::error::Error;

/// Who must act on a fault, or what it means for a person. The exit code follows from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blame {
    /// The request is impossible; it must be changed.
    Request,
    /// The operating system: files, disk, memory.
    System,
    /// The device does not exist, or cannot be opened.
    NoDevice,
    /// The device, its cable or its power.
    Device,
    /// Recorded data that cannot be used.
    Data,
    /// Frames that do not give a calibration.
    Rejection,
    /// A scan was interrupted, and can be resumed.
    Resumable,
    /// A match in which no pixel has an answer.
    NoAnswer,
    /// A surface that does not conform to its limits. Nothing failed.
    NotConforming,
    /// A surface about whose limits nothing is proven. Nothing failed.
    Undecided,
    /// The operator stopped it.
    Interruption,
}

/// An error that knows who must act. Each error says so beside its variants, and names every one of them.
pub trait Fault: Error {
    /// Who must act.
    fn blame(&self) -> Blame;

    /// The message for a person: one line, with line breaks in names replaced.
    fn message(&self) -> String {
        self.to_string().replace('\n', "\u{fffd}")
    }
}
