//! What is to be done with the rig.

use clap::Args;

use super::profile::Options;
use super::{camera_settings, simulator_config};
use crate::capture::{CaptureLimits, CapturePlan};
use crate::cli::CliError;
use crate::profile::{self, Profile};
use epirig_data::sequence::{FocalLength, NominalLens};

/// The plan of a scan.
#[derive(Debug, Args)]
#[command(next_help_heading = "The plan")]
pub(in crate::cli) struct PlanArguments {
    /// Distance between stops
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    step_mm: Option<String>,
    /// Number of frames
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    frames: Option<String>,
    /// Position of the first frame, from home
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    start_mm: Option<String>,
    /// How long the stage swings after a move [default: 200]
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    settle_ms: Option<String>,
    /// Average so many frames to one of 16 bit at each stop [default: 1]
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    average: Option<String>,
    /// How long to wait for a camera or a stage that goes in the middle of the scan [default: 300]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    wait_s: Option<String>,
    /// Focal length of the lens, in px; the principal point is taken to be the middle of the image
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    focal_length_px: Option<String>,
}

impl PlanArguments {
    /// As keys of a profile.
    pub(in crate::cli) fn options(&self, options: &mut Options) {
        options.add("plan.step_mm", "--step-mm", self.step_mm.as_ref());
        options.add("plan.frames", "--frames", self.frames.as_ref());
        options.add("plan.start_mm", "--start-mm", self.start_mm.as_ref());
        options.add("plan.settle_ms", "--settle-ms", self.settle_ms.as_ref());
        options.add("plan.average", "--average", self.average.as_ref());
        options.add("limits.wait_s", "--wait-s", self.wait_s.as_ref());
        options.add("optics.focal_length_px", "--focal-length-px", self.focal_length_px.as_ref());
    }
}

/// What a profile plans.
pub(in crate::cli) fn capture_plan(profile: &Profile) -> Result<CapturePlan, CliError> {
    let positions_mm = profile.plan.positions_mm().ok_or_else(|| rig_missing(&profile.plan))?;
    let limits = &profile.limits;
    if profile.plan.board > 0 && profile.board.is_none() {
        return Err(CliError::Usage(
            "plan.board asks for frames of a chess-board that is not described: set square, columns and rows in [board] of the rig \
             profile, or plan.board = 0"
                .to_owned(),
        ));
    }
    let simulator = if profile.camera.is_simulated() {
        Some(serde_json::to_value(simulator_config(profile)?).map_err(std::io::Error::other)?)
    } else {
        None
    };
    Ok(CapturePlan {
        settle: profile.plan.settle,
        camera: camera_settings(profile)?,
        averaged: profile.plan.average,
        dark: profile.plan.dark,
        flat: profile.plan.flat,
        board: profile.plan.board,
        limits: CaptureLimits {
            retakes: limits.retakes,
            saturated: limits.saturated,
            // What the driver is told to put up with, a scan does, too.
            position_mm: limits.position_mm.max(profile.stage.tolerance_mm),
            shift_px: limits.shift_px,
            wait: limits.wait,
        },
        lens: nominal_lens(&profile.optics),
        rig: Some(serde_json::to_value(profile).map_err(std::io::Error::other)?),
        simulator,
        ..CapturePlan::at(positions_mm)
    })
}

/// Of a plan that does not say how far the stage is to go, and how often.
fn rig_missing(plan: &profile::PlanProfile) -> CliError {
    let lacks = match (plan.step_mm, plan.frames) {
        (None, None) => "plan.step and plan.frames are",
        (None, _) => "plan.step is",
        _ => "plan.frames is",
    };
    CliError::Usage(format!(
        "{lacks} not known: set them in [plan] of the rig profile (take the # away), or give --step-mm and --frames. No profile yet? \
         `epirig init` writes one; `--rig sim` needs none, and no hardware"
    ))
}

/// The lens as the profile states it.
pub(in crate::cli) fn nominal_lens(optics: &profile::OpticsProfile) -> Option<NominalLens> {
    let focal_length = match optics.focal_length? {
        profile::FocalLength::Px(px) => FocalLength::Px(px),
        profile::FocalLength::Mm(length_mm) => FocalLength::ImageWidths(length_mm / optics.sensor_width_mm?),
    };
    Some(NominalLens { focal_length, principal_point_px: optics.principal_point_px })
}
