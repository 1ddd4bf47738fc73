//! The plan as the page shows it before a scan.

use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;

use super::name::{NAME_RULE, NameRule};
use crate::capture::CapturePlan;
use crate::panel::error::PanelError;
use crate::panel::shared::SharedState;
use crate::rig::capture_plan;
use epirig_data::storage::{free_bytes, is_there};

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct Plan {
    name: String,
    names: NameRule,
    folder: String,
    frames: usize,
    start_mm: f64,
    step_mm: f64,
    end_mm: f64,
    dark: usize,
    flat: usize,
    board: usize,
    averaged: usize,
    seconds: Option<f64>,
    needs_bytes: Option<u64>,
    free_bytes: Option<u64>,
}

/// The plan of the profile in use, with a name that is free.
pub(in crate::panel) fn plan(shared: &Arc<SharedState>) -> Result<Plan, PanelError> {
    let profile = shared.draft().profile()?;
    let plan = capture_plan(&profile)?;
    // A stage that is not there does not tell its travel; the scan itself will.
    if let Some(travel_mm) =
        shared.look(|state| Some(state.rig.stage.travel_mm).filter(|travel| *travel > 0.0))
    {
        plan.check_travel(travel_mm)?;
    }
    let (seconds, frame_bytes) = estimate(shared, &plan);
    let (frames, others) = (plan.positions_mm.len(), plan.calibration_frames());
    let needs_bytes = Some(frame_bytes.saturating_mul((frames + others) as u64)).filter(|bytes| *bytes > 0);
    Ok(Plan {
        name: free_name(shared),
        names: NAME_RULE,
        folder: shared.folder.display().to_string(),
        frames,
        start_mm: profile.plan.start_mm,
        step_mm: profile.plan.step_mm.unwrap_or_default(),
        end_mm: plan.positions_mm.last().copied().unwrap_or_default(),
        dark: plan.section.dark,
        flat: plan.section.flat,
        board: plan.section.board,
        averaged: plan.section.average,
        seconds: seconds.map(|time| time.as_secs_f64()),
        needs_bytes,
        free_bytes: free_bytes(&shared.folder),
    })
}

/// The first name of `scan-001`, `scan-002` ... that no folder has.
fn free_name(shared: &SharedState) -> String {
    let names = (1..).map(|number| format!("scan-{number:03}"));
    let is_free = |name: &String| !is_there(&shared.folder.join(name)).unwrap_or(false);
    names.take(100_000).find(is_free).unwrap_or_default()
}

/// How long a scan takes, if stage and camera tell, and the bytes of a frame (0 without a camera).
pub(super) fn estimate(shared: &SharedState, plan: &CapturePlan) -> (Option<Duration>, u64) {
    let (camera, stage) = shared.look(|state| (state.rig.camera.clone(), state.kinematics));
    let sample_bytes = if plan.section.average > 1 || camera.bit_depth > 8 { 2 } else { 1 };
    let frame_bytes = (camera.rows * camera.columns) as u64 * sample_bytes;
    let interval = camera.rate_hz.filter(|rate| *rate > 0.0).map(|rate| Duration::from_secs_f64(1.0 / rate));
    let duration = |mm| stage.map(|stage| stage.duration(mm));
    (plan.estimate(Some(frame_bytes), interval, duration).total(), frame_bytes)
}
