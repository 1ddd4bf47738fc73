//! The plan of a profile.

use super::{RigError, camera_settings, simulator_config};
use crate::capture::CapturePlan;
use crate::profile::{self, Profile};
use epirig_data::sequence::{FocalLength, NominalLens};

/// The plan of a profile.
///
/// # Errors
/// [`RigError`] if the plan is incomplete.
pub fn capture_plan(profile: &Profile) -> Result<CapturePlan, RigError> {
    let positions_mm = profile.plan.positions_mm().ok_or_else(|| missing(&profile.plan))?;
    if profile.plan.board > 0 && profile.board.chess_board().is_none() {
        return Err(RigError::NoBoard);
    }
    let simulated = profile.camera.is_simulated().then(|| simulator_config(profile)).transpose()?;
    let simulator = simulated.map(serde_json::to_value).transpose();
    let simulator = simulator.map_err(|error| RigError::Value { key: "sim", reason: error.to_string() })?;
    Ok(CapturePlan {
        positions_mm,
        camera: camera_settings(profile)?,
        section: profile.plan.clone(),
        limits: profile.scan_limits(),
        lens: nominal_lens(&profile.optics),
        rig: Some(profile.record()),
        simulator,
    })
}

/// The error for a plan without step or number of frames.
pub(super) fn missing(plan: &profile::PlanProfile) -> RigError {
    let lacks = match (plan.step_mm, plan.frames) {
        (None, None) => "plan.step and plan.frames are",
        (None, _) => "plan.step is",
        _ => "plan.frames is",
    };
    RigError::NoPlan(lacks)
}

/// The lens as described in the profile; `None` without a focal length.
pub fn nominal_lens(optics: &profile::OpticsProfile) -> Option<NominalLens> {
    let focal_length = match optics.focal_length? {
        profile::FocalLength::Px(px) => FocalLength::Px(px),
        profile::FocalLength::Mm(length_mm) => FocalLength::ImageWidths(length_mm / optics.sensor_width_mm?),
    };
    Some(NominalLens { focal_length, principal_point_px: optics.principal_point_px() })
}
