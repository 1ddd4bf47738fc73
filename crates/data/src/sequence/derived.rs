//! Sequences derived from others, such as rectified frames.

use std::path::Path;

use super::clock::{new_uid, now};
use super::error::SequenceError;
use super::record::{ExitStatus, FORMAT_VERSION, Intrinsics, Origin, SequenceRecord};
use super::writer::{FrameFacts, SequenceWriter, StopFacts, publish, refuse_existing, scratch_beside};
use crate::storage::RealDisk;
use epirig_core::frame::{Frame, FrameError};
use epirig_core::progress::Progress;

/// The record of a sequence that is made of another, without its frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Derived {
    /// Its source, and how it was made.
    pub origin: Origin,
    /// Rows of a frame.
    pub rows: usize,
    /// Columns of a frame.
    pub columns: usize,
    /// Bits of a sample.
    pub bit_depth: u8,
    /// Lens and pixels, if known.
    pub intrinsics: Option<Intrinsics>,
    /// Position of each frame, in mm; `None` if frames are equidistant at an unknown distance.
    pub positions_mm: Option<Vec<f64>>,
    /// The file that each frame is made of.
    pub sources: Vec<String>,
    /// How the source's scan ended: an error of its positions is one of these, too.
    pub exit_status: ExitStatus,
    /// Why it ended so, if it was not complete.
    pub reason: Option<String>,
}

/// Makes the sequence `out`, with a frame for each of its sources, which `frame` gives by their index.
///
/// It is built beside `out` and renamed when it is complete; a failure leaves nothing.
///
/// # Errors
/// [`SequenceError`] if `out` exists and is not empty, or cannot be written, or `frame` fails.
pub fn write_derived(
    out: &Path,
    derived: Derived,
    mut frame: impl FnMut(usize) -> Result<Frame, FrameError>,
    progress: &dyn Progress,
) -> Result<(), SequenceError> {
    refuse_existing(out)?;
    let Derived { origin, rows, columns, bit_depth, intrinsics, positions_mm, sources, exit_status, reason } =
        derived;
    let record = SequenceRecord {
        format: FORMAT_VERSION,
        uid: new_uid(),
        program: concat!("epirig ", env!("CARGO_PKG_VERSION")).to_owned(),
        created: now(),
        origin,
        rows,
        columns,
        bit_depth,
        frames: sources.len(),
        positions_mm,
        intrinsics,
    };
    let scratch = scratch_beside(out)?;
    let building = scratch.path().join("sequence");
    let mut writer = SequenceWriter::create(&building, &record)?;
    progress.begin("writing frames", sources.len() as u64);
    for (index, source) in sources.into_iter().enumerate() {
        let frame =
            frame(index).map_err(|source| SequenceError::BitDepth { path: out.to_owned(), source })?;
        let commanded_mm = record.positions_mm.as_ref().and_then(|positions| positions.get(index)).copied();
        writer.add(&frame, FrameFacts { commanded_mm, source: Some(source), ..FrameFacts::default() })?;
        progress.advance(1);
    }
    progress.end();
    writer.finish(exit_status, StopFacts { reason, ..StopFacts::default() })?;
    publish(&mut RealDisk, &building, out)
}
