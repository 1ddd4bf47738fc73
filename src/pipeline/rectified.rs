//! Writes a sequence of corrected and rectified frames.

use std::path::Path;

use super::PipelineError;
use super::geometry::calibrated_scale;
use crate::calibrate::{
    CalibrateError, Calibration, LensSource, PositionSource, frames_in_order, load_calibrated,
};
use epirig_calibration::photometry::Maps;
use epirig_core::frame::{Frame, Samples};
use epirig_core::progress::Progress;
use epirig_data::sequence::{
    ExitStatus, Intrinsics, Origin, Sequence, SequenceRecord, refuse_existing, write_derived,
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
    let volume = load_calibrated(sequence, calibration, maps, progress)?;
    let dn_per_sample = volume.dn_per_count();
    let camera = calibration.mapping.camera;
    let scale = calibrated_scale(calibration);
    let origin = Origin::Rectified {
        folder: sequence.folder().display().to_string(),
        sequence_uid: sequence.record().uid.clone(),
        calibration: calibration.hash(),
        dn_per_sample: f64::from(dn_per_sample),
        original_bit_depth: volume.bit_depth(),
        focal_length_sigma: scale.focal_length,
        baseline_sigma: scale.baseline,
    };
    let sources: Vec<String> =
        frames_in_order(sequence, Some(calibration)).iter().map(|record| record.file.clone()).collect();
    let record = SequenceRecord {
        intrinsics: (calibration.lens.source != LensSource::Unknown).then_some(Intrinsics {
            focal_length_px: camera.focal_length_px,
            principal_point_x_px: camera.principal_point_x_px,
            principal_point_y_px: camera.principal_point_y_px,
        }),
        positions_mm,
        ..SequenceRecord::new(origin, (volume.rows(), volume.columns()), BIT_DEPTH, sources.len())
    };
    // The end of the scan is the same for these frames.
    let exit_status = sequence.stop().map_or(ExitStatus::Aborted, |stop| stop.exit_status);
    let end = (exit_status, sequence.end_in_words());
    let mut row = vec![0.0_f32; volume.columns()];
    let frame = |t: usize| {
        let mut samples = Vec::with_capacity(volume.rows() * volume.columns());
        for y in 0..volume.rows() {
            volume.copy_row(y, t, &mut row);
            // Values that a gain raises above 16 bit are clipped.
            samples.extend(row.iter().map(|dn| (dn / dn_per_sample).round() as u16));
        }
        Frame::new(volume.rows(), volume.columns(), BIT_DEPTH, Samples::U16(samples))
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
