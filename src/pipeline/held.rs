//! Where the frames of a sequence are held while something is done with them: in memory, or packed on disk.

use std::sync::Arc;

use super::error::PipelineError;
use super::load::{load_packed, load_unpacked};
use super::need::{Frames, Held, calibration_need};
use super::packed::{PACKED, pack_sequence, packed_volume};
use crate::calibrate::{Calibration, CalibrationPlan, matched_shape};
use crate::memory::available;
use epirig_calibration::photometry::Maps;
use epirig_core::progress::{Progress, Silent};
use epirig_core::rows::RowSource;
use epirig_core::shell::quoted;
use epirig_data::packed::PackedVolume;
use epirig_data::sequence::{FrameKind, Sequence};
use epirig_matcher::{Blocks, MatchError, MatchOptions};

/// Where [`frames_to_match`] finds the frames of `sequence`.
///
/// # Errors
/// [`PipelineError`] if there is a packed volume that contradicts itself.
pub fn where_frames_are(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<Held, PipelineError> {
    Ok(match packed_volume(sequence, calibration, progress)? {
        Some(packed) if is_left_on_disk(&packed, options)? => Held::Packed,
        _ => Held::InMemory,
    })
}

/// Most bytes that something takes, by where its frames are.
pub type Need = fn(Frames, &MatchOptions, Held) -> u64;

/// Where the frames should be, so that what has this `need` takes `limit` bytes of memory, or half of what is free.
pub fn held(need: impl Fn(Held) -> u64, limit: Option<u64>) -> Held {
    let [whole, packed] = [Held::InMemory, Held::Packed].map(need);
    let limit = limit.or_else(|| Some(available()?.bytes / 2)).unwrap_or(u64::MAX);
    if whole <= limit || packed >= whole { Held::InMemory } else { Held::Packed }
}

/// Where the rectified frames of a calibration of `sequence` should be, so that it takes `limit` bytes of memory or half of
/// what is free; and the most bytes that it takes then.
pub fn calibration_held(sequence: &Sequence, plan: &CalibrationPlan, limit: Option<u64>) -> (Held, u64) {
    let record = sequence.record();
    let frames = Frames {
        count: sequence.frames().len(),
        rows: record.rows,
        columns: record.columns,
        sample_bytes: usize::from(record.bit_depth.div_ceil(8)),
    };
    let others = FrameKind::CALIBRATION.map(|kind| sequence.calibration_frames(kind).len());
    let need = |held| calibration_need(frames, others.iter().sum(), plan.positions, held);
    let held = held(need, limit);
    (held, need(held))
}

/// Packs frames with which something would take more memory than `limit` bytes, or than half of what is free, unless they
/// are packed. Where they are then.
///
/// # Errors
/// [`PipelineError`] naming the frame that cannot be used, or the file that cannot be written.
pub fn pack_if_large(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    options: &MatchOptions,
    (need, limit): (Need, Option<u64>),
    progress: &dyn Progress,
) -> Result<Held, PipelineError> {
    if where_frames_are(sequence, calibration, options, &Silent)? == Held::Packed {
        return Ok(Held::Packed);
    }
    let shape = matched_shape(sequence, calibration.map(|(calibration, _)| calibration))?;
    let held = held(|held| need(Frames::of(&shape), options, held), limit);
    if held == Held::Packed {
        let out = sequence.folder().join(PACKED);
        progress.note(&format!(
            "the frames are packed as {} first, because they are more than memory should hold; it may be removed afterwards",
            quoted(&out)
        ));
        pack_sequence(sequence, calibration, &out, progress)?;
    }
    Ok(held)
}

/// Whether a match needs several blocks.
fn is_left_on_disk(packed: &PackedVolume, options: &MatchOptions) -> Result<bool, MatchError> {
    Ok(!Blocks::new(packed.shape(), options.clone())?.needs_all_rows())
}

/// The frames of `sequence`, for matches with these `options`: packed ones of several blocks of rows stay on disk, others
/// are in memory.
///
/// # Errors
/// [`PipelineError`] naming the frame that cannot be used.
pub fn frames_to_match(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    options: &MatchOptions,
    progress: &dyn Progress,
) -> Result<Arc<dyn RowSource>, PipelineError> {
    Ok(match packed_volume(sequence, calibration, progress)? {
        Some(packed) if is_left_on_disk(&packed, options)? => Arc::new(packed),
        Some(packed) => Arc::new(load_packed(&packed, progress)?),
        None => Arc::new(load_unpacked(sequence, calibration, progress)?),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::match_need;

    #[test]
    fn frames_that_are_more_than_memory_should_hold_are_packed() {
        let options = MatchOptions::default();
        let large = Frames { count: 100, rows: 3648, columns: 5472, sample_bytes: 1 };
        let by = |frames, limit| held(|held| match_need(frames, &options, held), Some(limit));
        assert_eq!(by(large, 8 << 30), Held::InMemory);
        assert_eq!(by(large, 2 << 30), Held::Packed);
        assert!(match_need(large, &options, Held::Packed) < 1 << 30);
        // Packing frames of a single block would save nothing.
        assert_eq!(by(Frames { rows: 500, columns: 700, ..large }, 1 << 20), Held::InMemory);
    }
}
