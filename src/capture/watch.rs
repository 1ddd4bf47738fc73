//! Looking on while a scan runs.

use epirig_core::frame::Frame;
use epirig_data::sequence::{FrameFacts, FrameKind};

/// A part of the rig that a scan waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Awaited {
    /// The camera was disconnected.
    Camera,
    /// The stage does not answer, or cannot be homed.
    Stage,
}

/// Is told what a scan does. All methods are called in the thread of the scan, so they must return at once, but for
/// [`rests`](Self::rests).
pub trait ScanWatcher {
    /// A frame is good, and on its way to the disk.
    fn frame(&self, _kind: FrameKind, _index: usize, _frame: &Frame, _facts: &FrameFacts) {}

    /// A frame of the scan is done. The stage rests until this returns, which may take its time.
    fn rests(&self) {}

    /// An attempt (counted from 1) to take a frame of the scan has failed.
    fn failed(&self, _index: usize, _attempt: usize, _reason: &str) {}

    /// Whether pictures are wanted while the stage moves; the camera then shows them to its onlooker.
    fn wants_pictures(&self) -> bool {
        false
    }

    /// The scan waits for a part of the rig, or no longer for any.
    fn waits_for(&self, _part: Option<Awaited>) {}
}

/// Nobody looks on.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unwatched;

impl ScanWatcher for Unwatched {}
