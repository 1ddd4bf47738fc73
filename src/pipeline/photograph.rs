//! A frame as the matcher saw it, to be shown beside maps.

use super::error::PipelineError;
use crate::calibrate::{CalibrateError, Calibration, frames_in_order, rectifier};
use epirig_calibration::photometry::Maps;
use epirig_calibration::rectification::Rectifier;
use epirig_core::grid::Grid;
use epirig_core::rows::RowSource as _;
use epirig_core::tau::Tau;
use epirig_data::sequence::{FrameRecord, Sequence};

/// Frame `t` of `sequence` as it is matched, in DN: with a calibration corrected and rectified, and counted in the order
/// of its positions; rows x columns of the maps. NaN where it shows nothing.
///
/// # Errors
/// [`PipelineError`] if there is no such frame, or it cannot be read or rectified.
pub fn matched_frame(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    t: usize,
) -> Result<Grid<f32>, PipelineError> {
    let made = calibration.map(|(calibration, maps)| rectifier(sequence, calibration, maps)).transpose()?;
    let calibration = calibration.map(|(calibration, _)| calibration);
    let frames = frames_in_order(sequence, calibration);
    Ok(as_far_as_seen(frame_in_dn(sequence, &frames, t, made.as_ref())?, t, calibration))
}

/// Frame `t` with NaN where it shows nothing: a frame of a camera that was turned is not a rectangle once it is
/// rectified.
pub(super) fn as_far_as_seen(frame: Grid<f32>, t: usize, calibration: Option<&Calibration>) -> Grid<f32> {
    let Some(calibration) = calibration.filter(|calibration| calibration.has_motion()) else { return frame };
    let pose = calibration.poses().get(t).copied().unwrap_or_default();
    let seen = calibration.mapping.seen(&[pose]);
    let mut frame = frame;
    let pixels = frame.values_mut().iter_mut().zip(seen.values());
    pixels.filter(|(_, seen)| !**seen).for_each(|(value, _)| *value = f32::NAN);
    frame
}

/// Frame `t` of these `frames` of `sequence` in DN: with a rectifier corrected and rectified.
///
/// # Errors
/// As [`matched_frame`].
pub fn frame_in_dn(
    sequence: &Sequence,
    frames: &[&FrameRecord],
    t: usize,
    rectifier: Option<&Rectifier>,
) -> Result<Grid<f32>, PipelineError> {
    let record = frames.get(t).ok_or(PipelineError::NoSuchFrame(t))?;
    let frame = sequence.read(record)?;
    let Some(rectifier) = rectifier else {
        let mut grid = Grid::filled(frame.rows(), frame.columns(), 0.0_f32);
        frame.samples().copy_to_f32(0, grid.values_mut());
        return Ok(grid);
    };
    // A volume has two frames at least.
    let tau = Tau::equidistant(2).map_err(CalibrateError::Positions)?;
    let mut volume = rectifier.volume(frame.bit_depth(), tau);
    rectifier.insert_as(&mut volume, (0, t), &[frame]).map_err(CalibrateError::Rectify)?;
    Ok(volume.frame(0)?)
}
