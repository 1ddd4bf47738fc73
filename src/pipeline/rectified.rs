//! Writes a sequence of corrected and rectified frames.

use std::path::Path;

use super::PipelineError;
use super::geometry::calibrated_scale;
use crate::calibrate::{CalibrateError, Calibration, LensSource, MatchedFrames, PositionSource};
use epirig_calibration::photometry::Maps;
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Progress;
use epirig_data::sequence::{
    ExitStatus, Intrinsics, Origin, Sequence, SequenceError, SequenceRecord, refuse_existing, write_derived,
};

/// Bit depth of the samples, which keeps values between the camera's levels.
const BIT_DEPTH: u8 = 16;

/// Writes the sequence `out` from the frames of `sequence`, corrected and rectified by its calibration, in 16
/// bit. Other software then sees the frames that `match` uses. The new sequence has the measured positions,
/// and the rectified camera as its lens, if it is known.
///
/// # Errors
/// [`PipelineError`]; nothing is left then. [`CalibrateError::NoBaseline`] if positions were measured but
/// their scale in mm is unknown.
pub fn rectify_sequence(
    sequence: &Sequence,
    (calibration, maps): &(Calibration, Maps),
    out: &Path,
    progress: &dyn Progress,
) -> Result<SequenceRecord, PipelineError> {
    refuse_existing(out)?;
    let positions_mm = positions_mm(sequence, calibration)?;
    let frames = MatchedFrames::of(sequence, Some((calibration, maps)))?;
    let shape = frames.shape().clone();
    let dn_per_sample = shape.of_rows(0).dn_per_count();
    let camera = calibration.mapping.camera;
    let scale = calibrated_scale(calibration);
    let origin = Origin::Rectified {
        folder: sequence.folder().display().to_string(),
        sequence_uid: sequence.record().uid.clone(),
        calibration: calibration.hash(),
        dn_per_sample: f64::from(dn_per_sample),
        original_bit_depth: shape.bit_depth,
        focal_length_sigma: scale.focal_length,
        baseline_sigma: scale.baseline,
    };
    let sources: Vec<String> = frames.records().iter().map(|record| record.file.clone()).collect();
    let record = SequenceRecord {
        intrinsics: (calibration.lens.source != LensSource::Unknown).then_some(Intrinsics {
            focal_length_px: camera.focal_length_px,
            principal_point_x_px: camera.principal_point_x_px,
            principal_point_y_px: camera.principal_point_y_px,
        }),
        positions_mm,
        ..SequenceRecord::new(origin, (shape.rows, shape.columns), BIT_DEPTH, sources.len())
    };
    // The end of the scan is the same for these frames.
    let exit_status = sequence.stop().map_or(ExitStatus::Aborted, |stop| stop.exit_status);
    let end = (exit_status, sequence.end_in_words());
    let mut row = vec![0.0_f32; shape.columns];
    let mut few = None;
    let frame = |t: usize| -> Result<Frame, PipelineError> {
        let place = t % MatchedFrames::TOGETHER;
        if place == 0 {
            few = Some(frames.group(t)?);
        }
        let few = few.as_ref().ok_or(PipelineError::NoSuchFrame(t))?;
        let mut samples = Vec::with_capacity(shape.rows * shape.columns);
        for y in 0..shape.rows {
            few.copy_row(y, place, &mut row);
            // Values that a gain raises above 16 bit are clipped.
            samples.extend(row.iter().map(|dn| (dn / dn_per_sample).round() as u16));
        }
        let frame = Frame::new(shape.rows, shape.columns, BIT_DEPTH, Samples::U16(samples));
        Ok(frame.map_err(|source| SequenceError::BitDepth { path: out.to_owned(), source })?)
    };
    tracing::info_span!("rectification")
        .in_scope(|| write_derived(out, &record, sources, end, frame, progress))?;
    Ok(record)
}

/// The measured positions, with the first at its reported position.
fn positions_mm(sequence: &Sequence, calibration: &Calibration) -> Result<Option<Vec<f64>>, CalibrateError> {
    let positions = &calibration.positions;
    let first_mm = sequence.positions_mm().and_then(|reported| reported.first().copied()).unwrap_or(0.0);
    match positions.baseline_mm {
        Some(baseline_mm) => Ok(Some(positions.tau.iter().map(|tau| first_mm + tau * baseline_mm).collect())),
        // Then the frames are evenly spaced.
        None if positions.source == PositionSource::Stage => Ok(None),
        None => Err(CalibrateError::NoBaseline),
    }
}
