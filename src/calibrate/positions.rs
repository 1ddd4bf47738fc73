//! Positions of all frames, from the target or from the stage.

use super::remarks::Remarks;
use super::stage_axis::FoundAxis;
use super::{CalibrateError, PositionSource, PositionsRecord};
use epirig_calibration::stage_axis::{TargetScale, positioning_error};
use epirig_core::tau::Tau;
use epirig_data::sequence::Sequence;

/// Largest difference between the size of printed squares and the stage's scale, in %. Printers that scale
/// "to fit" are off by 3 % and more, good ones by 0.2 %.
const SCALE_LIMIT_PERCENT: f64 = 2.0;

/// As reported by the stage, or evenly spaced if there is no report.
pub(super) fn from_stage(sequence: &Sequence) -> Result<PositionsRecord, CalibrateError> {
    let tau = sequence.tau()?;
    let baseline_mm =
        sequence.positions_mm().and_then(|positions| Some(positions.last()? - positions.first()?));
    Ok(PositionsRecord {
        source: PositionSource::Stage,
        order: Vec::new(),
        tau_sigma: vec![None; tau.frames()],
        tau: tau.values().to_vec(),
        baseline_mm,
        baseline_sigma_mm: None,
        positioning_error: None,
        target_scale: None,
    })
}

/// As seen by the target, on the stage's scale; on the scale of the squares if the stage's is unknown.
pub(super) fn from_target(
    sequence: &Sequence,
    found: &FoundAxis,
    remarks: &mut Remarks,
) -> Result<PositionsRecord, CalibrateError> {
    let reported = sequence.positions_mm();
    let counted: Vec<f64> = (0..sequence.frames().len()).map(|index| index as f64).collect();
    let scale = reported.as_ref().unwrap_or(&counted);
    let Some(positioning) = positioning_error(&found.stage_axis.tau, scale) else {
        return from_stage(sequence);
    };
    let measured: Vec<f64> = positioning.frames.iter().map(|frame| frame.measured_mm).collect();
    let tau = Tau::from_positions(&measured)?;
    let span = positioning.baseline_mm;
    let tau_sigma = positioning.frames.iter().map(|frame| frame.sigma_mm.map(|sigma| sigma / span)).collect();
    let mut record = PositionsRecord {
        source: PositionSource::Target,
        order: Vec::new(),
        tau: tau.values().to_vec(),
        tau_sigma,
        baseline_mm: found.baseline_by_target_mm,
        baseline_sigma_mm: None,
        positioning_error: None,
        target_scale: None,
    };
    if reported.is_none() {
        return Ok(record);
    }
    if let Some(baseline_mm) = found.baseline_by_target_mm {
        let scale = TargetScale { baseline_mm, reported_mm: span };
        let percent = 100.0 * scale.contradiction();
        if percent.abs() > SCALE_LIMIT_PERCENT {
            return Err(CalibrateError::ScaleContradicts {
                target_mm: baseline_mm,
                stage_mm: span,
                percent,
                limit_percent: SCALE_LIMIT_PERCENT,
            });
        }
        record.target_scale = Some(scale);
    }
    if !positioning.outliers.is_empty() {
        let names: Vec<String> = positioning
            .outliers
            .iter()
            .map(|&frame| format!("{frame} ({:+.1} um)", positioning.error_um(frame)))
            .collect();
        remarks.notes.push(format!("the stage reported wrong positions in frames {}", names.join(", ")));
    }
    record.baseline_mm = Some(span);
    record.baseline_sigma_mm = Some(positioning.baseline_sigma_mm);
    record.positioning_error = Some(positioning);
    Ok(record)
}
