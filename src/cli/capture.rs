//! `epirig capture`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use serde::Serialize;

use super::camera_arguments::CameraArguments;
use super::stage_arguments::StageArguments;
use super::{CliError, Talk};
use crate::capture::{CapturePlan, capture};
use crate::stage::Stage;

/// Move the stage in steps and take a frame at each stop
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig capture --out seq --step-mm 1.5 --frames 101
  epirig capture --out seq --step-mm 1.5 --frames 101 --start-mm 10 --approach-mm 0.5 --average 4
  epirig capture --out seq --step-mm 0.5 --frames 20 --driver sim --camera sim      no hardware needed

The stage is homed first. Frames count only if they were begun after the stage came to rest; what is known of each is in
the journal of the sequence. Ctrl-C stops the stage; the frames taken until then stay.")]
pub(super) struct Capture {
    /// Folder of the new sequence
    #[arg(long, value_name = "SEQ")]
    out: PathBuf,
    /// Distance between stops
    #[arg(long, value_name = "MM")]
    step_mm: f64,
    /// Number of frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    frames: u32,
    /// Position of the first frame, from home
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    start_mm: f64,
    /// How long the stage swings after a move
    #[arg(long, value_name = "MS", default_value_t = 200)]
    settle_ms: u64,
    /// Average so many frames to one of 16 bit at each stop
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=65536))]
    average: u32,
    /// How long to wait for a camera that goes in the middle of the scan
    #[arg(long, value_name = "S", default_value_t = 30)]
    reconnect_s: u64,
    #[command(flatten)]
    stage: StageArguments,
    #[command(flatten)]
    camera: CameraArguments,
}

#[derive(Serialize)]
struct Captured {
    folder: String,
    frames: usize,
}

impl Capture {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        if !(self.step_mm.is_finite() && self.step_mm > 0.0 && self.start_mm.is_finite()) {
            return Err(CliError::Usage("--step-mm must be positive, and --start-mm a number".to_owned()));
        }
        let (mut stage, watch) = self.stage.connect_and_watch(talk)?;
        if self.camera.is_simulated() && watch.is_none() {
            return Err(CliError::Usage(
                "--camera sim looks at the stage in memory; add --driver sim".to_owned(),
            ));
        }
        let mut camera = self.camera.open(&watch.unwrap_or_default())?;
        let positions = (0..self.frames).map(|index| self.start_mm + f64::from(index) * self.step_mm);
        let plan = CapturePlan {
            settle: Duration::from_millis(self.settle_ms),
            camera: self.camera.settings()?,
            averaged: self.average as usize,
            reconnect: Duration::from_secs(self.reconnect_s),
            ..CapturePlan::at(positions.collect())
        };
        refuse_beyond_travel(&*stage, &plan)?;
        capture(&mut *stage, &mut *camera, &plan, &self.out, talk)?;
        let captured = Captured { folder: self.out.display().to_string(), frames: plan.positions_mm.len() };
        talk.result(&captured, || {
            let Captured { folder, frames } = &captured;
            format!("{frames} frames in {folder}; `epirig verify {folder}` checks them\n")
        })
    }
}

/// A scan that cannot end need not begin.
fn refuse_beyond_travel(stage: &dyn Stage, plan: &CapturePlan) -> Result<(), CliError> {
    let travel_mm = stage.travel_mm();
    let beyond = plan.positions_mm.iter().find(|position_mm| !(0.0..=travel_mm).contains(*position_mm));
    beyond.map_or(Ok(()), |position_mm| {
        Err(CliError::Usage(format!(
            "the scan would go to {position_mm} mm; the stage goes from 0 to {travel_mm} mm"
        )))
    })
}
