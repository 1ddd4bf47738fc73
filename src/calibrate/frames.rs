//! Frames of a sequence, as they were taken.

use rayon::prelude::*;

use super::{CalibrateError, Calibration};
use epirig_core::frame::Frame;
use epirig_core::progress::Progress;
use epirig_data::sequence::{FrameRecord, Sequence};

/// The frames in the order in which they are matched: with a calibration that of its positions, else as they were taken.
pub fn frames_in_order<'a>(
    sequence: &'a Sequence,
    calibration: Option<&Calibration>,
) -> Vec<&'a FrameRecord> {
    let frames = sequence.frames();
    match calibration.map(|calibration| &calibration.positions.order) {
        Some(order) if !order.is_empty() => order.iter().filter_map(|&frame| frames.get(frame)).collect(),
        _ => frames.iter().collect(),
    }
}

/// Reads frames in parallel.
pub(super) fn read_all(
    sequence: &Sequence,
    records: &[FrameRecord],
    what: &str,
    progress: &dyn Progress,
) -> Result<Vec<Frame>, CalibrateError> {
    if records.is_empty() {
        return Ok(Vec::new());
    }
    progress.begin(what, records.len() as u64);
    let frames: Result<Vec<Frame>, CalibrateError> = records
        .par_iter()
        .map(|record| {
            progress.unless_cancelled()?;
            let frame = sequence.read(record)?;
            progress.advance(1);
            Ok(frame)
        })
        .collect();
    progress.end();
    frames
}
