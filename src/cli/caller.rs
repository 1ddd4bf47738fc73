//! A program that calls a verb.

use std::sync::Arc;

use super::interrupt::Switches;
use epirig_core::frame::Frame;
use epirig_core::progress::{Progress, Silent};
use epirig_data::sequence::FrameFacts;

/// Who calls a verb: is told of its progress and its remarks, and may cancel it.
pub type Caller = Arc<dyn CalledFrom>;

/// What a caller hears of a verb: its progress and remarks; of a scan, each good frame, too.
pub trait CalledFrom: Progress + Send + Sync {
    /// A frame of the scan is good, and on its way to the disk.
    fn frame(&self, _index: usize, _frame: &Frame, _facts: &FrameFacts) {}

    /// A frame of the scan is done. The stage rests until this returns.
    fn rests(&self) {}

    /// What an interruption of this verb presses; `None` if nothing interrupts it.
    fn switches(&self) -> Option<&Switches> {
        None
    }
}

impl CalledFrom for Silent {}
