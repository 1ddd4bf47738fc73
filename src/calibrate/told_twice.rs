//! Consistency of redundant values in a calibration, with each other and with its sequence.

use super::{Calibration, PositionSource, PositionsRecord};
use epirig_core::tau::Tau;
use epirig_data::sequence::Sequence;

/// The first contradiction within the record, if there is one.
pub(super) fn by_itself(calibration: &Calibration) -> Option<String> {
    let Calibration { lens, mapping, stage_axis, camera_motion, positions, .. } = calibration;
    if lens.estimate.lens != mapping.lens {
        return Some("its mapping belongs to another lens than its lens record".to_owned());
    }
    let direction = stage_axis.as_ref().map(|axis| axis.direction).unwrap_or_default();
    let turned = match camera_motion.as_ref().filter(|motion| motion.is_applied) {
        Some(motion) => [motion.roll_deg.to_radians(), motion.pan_deg.to_radians()],
        None => [direction.roll_rad, direction.pan_rad],
    };
    if turned != [mapping.roll_rad, mapping.pan_rad] {
        return Some("its mapping belongs to another stage axis than its record".to_owned());
    }
    if let Some(axis) = stage_axis
        && (differ(axis.roll_deg, direction.roll_rad.to_degrees())
            || differ(axis.pan_deg, direction.pan_rad.to_degrees()))
    {
        return Some("its roll or pan differs between deg and rad".to_owned());
    }
    wrong_tau(positions).or_else(|| wrong_positions(positions))
}

/// The first contradiction to its sequence.
pub(super) fn by_sequence(calibration: &Calibration, sequence: &Sequence) -> Option<String> {
    let positions = &calibration.positions;
    if positions.source == PositionSource::Stage {
        // If a sequence has no tau, its own checks report why.
        return other_tau(positions, "the sequence", sequence.tau().ok()?.values());
    }
    let error = positions.positioning_error.as_ref()?;
    let reported_mm = sequence.positions_mm()?;
    let frame = error.frames.iter().zip(&reported_mm).position(|(frame, mm)| frame.reported_mm != *mm)?;
    Some(format!("its reported position of frame {frame} differs from the sequence"))
}

/// Whether two results of different formulas differ beyond rounding.
fn differ(one: f64, other: f64) -> bool {
    let off = (one - other).abs() / one.abs().max(other.abs()).max(1.0);
    // NaN differs from everything.
    off.is_nan() || off > 1e-9
}

fn wrong_tau(positions: &PositionsRecord) -> Option<String> {
    match Tau::from_positions(&positions.tau) {
        // The first frame is at 0 and the last at 1, so the positions are their own tau.
        Ok(tau) => (positions.tau != tau.values()).then(|| "its tau does not go from 0 to 1".to_owned()),
        Err(error) => Some(format!("its positions are wrong ({error})")),
    }
}

fn other_tau(positions: &PositionsRecord, what: &str, tau: &[f64]) -> Option<String> {
    let frame = positions.tau.iter().zip(tau).position(|(one, other)| differ(*one, *other))?;
    Some(format!("its tau of frame {frame} differs from {what}"))
}

/// tau and baseline, compared with the measured positions behind them.
fn wrong_positions(positions: &PositionsRecord) -> Option<String> {
    let error = positions.positioning_error.as_ref()?;
    let measured: Vec<f64> = error.frames.iter().map(|frame| frame.measured_mm).collect();
    let (first, last) = (measured.first()?, measured.last()?);
    let told = Tau::from_positions(&measured).map_or(Vec::new(), |tau| tau.values().to_vec());
    if told.len() != positions.tau.len() {
        return Some("it has another number of measured positions than frames".to_owned());
    }
    let by_stage = positions.target_scale.map(|scale| scale.reported_mm);
    let baselines = [Some(error.baseline_mm), positions.baseline_mm, by_stage];
    if baselines.into_iter().flatten().any(|baseline_mm| differ(baseline_mm, last - first)) {
        return Some("its baseline differs from its measured positions".to_owned());
    }
    other_tau(positions, "its measured positions", &told)
}
