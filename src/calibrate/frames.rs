//! Frames of a sequence: raw, or corrected and rectified as a volume.

use rayon::prelude::*;

use super::{CalibrateError, Calibration};
use epirig_calibration::rectification::Rectifier;
use epirig_core::frame::Frame;
use epirig_core::progress::Progress;
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_data::sequence::{FrameRecord, Sequence};

/// Frames read and rectified together: the eight lanes of the rectifier.
const TOGETHER: usize = 8;

/// Loads a few frames at a time, so that only those are in memory besides the volume.
pub(super) fn load(
    sequence: &Sequence,
    records: &[&FrameRecord],
    rectifier: &Rectifier,
    tau: Tau,
    progress: &dyn Progress,
) -> Result<Volume, CalibrateError> {
    let mut volume = rectifier.volume(sequence.record().bit_depth, tau);
    progress.begin("rectifying frames", records.len() as u64);
    for (chunk, records) in records.chunks(TOGETHER).enumerate() {
        progress.unless_cancelled()?;
        let frames: Result<Vec<_>, _> = records.par_iter().map(|record| sequence.read(record)).collect();
        rectifier.insert(&mut volume, chunk * TOGETHER, &frames?)?;
        progress.advance(records.len() as u64);
    }
    progress.end();
    Ok(volume)
}

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

/// Equalises the brightness of all frames, whose gains these are.
pub(super) fn set_gains(volume: &mut Volume, gains: &[f64]) {
    for (frame, gain) in gains.iter().enumerate() {
        volume.set_frame_gain(frame, (1.0 / gain) as f32);
    }
}
