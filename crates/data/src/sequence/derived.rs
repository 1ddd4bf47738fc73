//! Sequences derived from others, such as rectified frames.

use std::path::Path;

use super::error::SequenceError;
use super::record::{ExitStatus, SequenceRecord};
use super::writer::{FrameFacts, SequenceWriter, StopFacts, publish, refuse_existing, scratch_beside};
use crate::storage::RealDisk;
use epirig_core::frame::Frame;
use epirig_core::progress::{Cancelled, Progress};

/// Makes the sequence `out`, with a frame for each of `sources`, the files that they are made of; `frame` gives them
/// by their index. `end` is how the source's scan ended, and why: an error of its positions is one of these, too.
///
/// It is built beside `out` and renamed when it is complete; a failure leaves nothing.
///
/// # Errors
/// [`SequenceError`] if `out` exists and is not empty, or cannot be written; what `frame` fails with.
pub fn write_derived<E: From<SequenceError> + From<Cancelled>>(
    out: &Path,
    record: &SequenceRecord,
    sources: Vec<String>,
    (exit_status, reason): (ExitStatus, Option<String>),
    mut frame: impl FnMut(usize) -> Result<Frame, E>,
    progress: &dyn Progress,
) -> Result<(), E> {
    refuse_existing(out)?;
    let scratch = scratch_beside(out)?;
    let building = scratch.path().join("sequence");
    let mut writer = SequenceWriter::create(&building, record)?;
    progress.begin("writing frames", sources.len() as u64);
    for (index, source) in sources.into_iter().enumerate() {
        progress.unless_cancelled()?;
        let frame = frame(index)?;
        let commanded_mm = record.positions_mm.as_ref().and_then(|positions| positions.get(index)).copied();
        writer.add(&frame, FrameFacts { commanded_mm, source: Some(source), ..FrameFacts::default() })?;
        progress.advance(1);
    }
    progress.end();
    writer.finish(exit_status, StopFacts { reason, ..StopFacts::default() })?;
    Ok(publish(&mut RealDisk, &building, out)?)
}
