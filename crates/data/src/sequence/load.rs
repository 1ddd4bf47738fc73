//! Frames of a sequence, read as a volume.

use rayon::prelude::*;

use super::{Origin, Sequence, SequenceError};
use epirig_core::progress::Progress;
use epirig_core::volume::Volume;

/// Reads all frames of `sequence` into a volume: a few at a time, so that besides the volume only those are
/// in memory. Frames that were rectified have the DN of their originals: noise and cost mean the same in
/// both.
///
/// # Errors
/// [`SequenceError`] naming the first frame that cannot be used, or
/// [`Contradiction`](SequenceError::Contradiction) if the records are not to be believed.
pub fn load_volume(sequence: &Sequence, progress: &dyn Progress) -> Result<Volume, SequenceError> {
    let record = sequence.record();
    let tau = sequence.tau()?;
    sequence.check_records()?;
    // The size in the record is believed only after a frame has shown it.
    if let Some(first) = sequence.frames().first() {
        sequence.read(first)?;
    }
    let original_bits = match record.origin {
        Origin::Rectified { original_bit_depth, .. } => Some(original_bit_depth),
        Origin::Captured { .. } | Origin::Imported { .. } => None,
    };
    let mut volume = match original_bits {
        Some(bits) => Volume::fine(record.rows, record.columns, bits, tau),
        None => Volume::new(record.rows, record.columns, record.bit_depth, tau),
    };
    progress.begin("reading frames", sequence.frames().len() as u64);
    let together = rayon::current_num_threads().max(1);
    for (chunk, records) in sequence.frames().chunks(together).enumerate() {
        let frames: Vec<_> = records.par_iter().map(|record| sequence.read(record)).collect();
        for (offset, frame) in frames.into_iter().enumerate() {
            let index = chunk * together + offset;
            match original_bits {
                Some(_) => volume.insert_counts(index, &frame?)?,
                None => volume.insert(index, &frame?)?,
            }
            progress.advance(1);
        }
    }
    progress.end();
    Ok(volume)
}
