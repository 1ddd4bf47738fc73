//! Heights by two halves of the frames, for depths that nothing was selected by.

use super::{Frames, OpenedResults, PipelineError, frames_to_match};
use epirig_core::progress::Progress;
use epirig_data::sequence::Sequence;
use epirig_matcher::evaluate::{SplitHalfError, match_halves};
use epirig_surface::HalfHeights;

/// The frames that [`half_heights`] holds in memory, for [`halves_need`](super::halves_need).
pub fn half_frames(sequence: &Sequence, opened: &OpenedResults) -> Frames {
    let (rows, columns) = (opened.disparity.rows(), opened.disparity.columns());
    let deep = opened.calibration.is_some() || sequence.record().bit_depth > 8;
    Frames { count: sequence.frames().len(), rows, columns, sample_bytes: if deep { 2 } else { 1 } }
}

/// Matches the two halves of `sequence` as its results were matched. `None` without heights, or if there are too few
/// frames.
///
/// # Errors
/// [`PipelineError`] if frames cannot be read or a half cannot be matched.
pub fn half_heights(
    sequence: &Sequence,
    opened: &OpenedResults,
    progress: &dyn Progress,
) -> Result<Option<[HalfHeights; 2]>, PipelineError> {
    let Some(heights) = &opened.heights else { return Ok(None) };
    let options = opened.matched.options();
    let frames = frames_to_match(sequence, opened.calibration.as_ref(), &options, progress)?;
    match match_halves(&frames, opened.matched.reference, &options, progress) {
        Err(SplitHalfError::TooFewFrames(_)) => Ok(None),
        halves => Ok(Some(halves?.map(|half| heights.of_half(&half)))),
    }
}
