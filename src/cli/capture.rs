//! `epirig capture`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use serde::Serialize;

use super::camera_arguments::{CameraArguments, tell_configuration};
use super::import::parse_positive;
use super::stage_arguments::StageArguments;
use super::{CliError, Talk};
use crate::capture::{CapturePlan, capture};
use crate::sequence::{Intrinsics, Sequence};
use crate::stage::Stage;

/// Move the stage in steps and take a frame at each stop
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig capture --out seq --step-mm 1.5 --frames 101
  epirig capture --out seq --step-mm 1.5 --frames 101 --start-mm 10 --average 4
  epirig capture --out seq --step-mm 0.5 --frames 20 --driver sim --camera sim   (no hardware)

The stage is homed first. Frames count only if they were begun after the stage came to rest; what is
known of each is in the journal of the sequence. Ctrl-C stops the stage; the frames taken until then stay.
Height in mm needs the focal length.")]
pub(super) struct Capture {
    /// Folder of the new sequence
    #[arg(long, value_name = "SEQ")]
    out: PathBuf,
    /// Distance between stops
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = parse_positive)]
    step_mm: f64,
    /// Number of frames
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    frames: u32,
    /// Position of the first frame, from home
    #[arg(long, value_name = "MM", allow_negative_numbers = true, default_value_t = 0.0)]
    start_mm: f64,
    /// How long the stage swings after a move
    #[arg(long, value_name = "MS", allow_negative_numbers = true, default_value_t = 200)]
    settle_ms: u64,
    /// Average so many frames to one of 16 bit at each stop
    #[arg(long, value_name = "K", allow_negative_numbers = true, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=65536))]
    average: u32,
    /// How long to wait for a camera that goes in the middle of the scan
    #[arg(long, value_name = "S", allow_negative_numbers = true, default_value_t = 30)]
    reconnect_s: u64,
    /// Focal length of the lens, in px; the principal point is taken to be the middle of the image
    #[arg(long, value_name = "PX", allow_negative_numbers = true, value_parser = parse_positive)]
    focal_length_px: Option<f64>,
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
        let (mut stage, watch) = self.stage.connect_and_watch(talk)?;
        if self.camera.is_simulated() && watch.is_none() {
            return Err(CliError::Usage(
                "--camera sim looks at the stage in memory; add --driver sim".to_owned(),
            ));
        }
        let mut camera = self.camera.open(&watch.unwrap_or_default())?;
        let positions = (0..self.frames).map(|index| self.start_mm + f64::from(index) * self.step_mm);
        let mut plan = CapturePlan {
            settle: Duration::from_millis(self.settle_ms),
            camera: self.camera.settings()?,
            averaged: self.average as usize,
            reconnect: Duration::from_secs(self.reconnect_s),
            ..CapturePlan::at(positions.collect())
        };
        refuse_beyond_travel(&*stage, &plan)?;
        let configuration = camera.configure(&plan.camera)?;
        tell_configuration(&configuration, talk);
        let (columns, rows) = (configuration.columns, configuration.rows);
        plan.intrinsics = self.focal_length_px.map(|length_px| Intrinsics::centred(length_px, columns, rows));
        let there_before = self.out.exists();
        let captured = capture(&mut *stage, &mut *camera, &plan, &self.out, talk);
        if captured.is_err() && !there_before {
            self.tell_what_stays(talk);
        }
        captured?;
        let captured = Captured { folder: self.out.display().to_string(), frames: plan.positions_mm.len() };
        talk.result(&captured, || {
            let Captured { folder, frames } = &captured;
            format!("{frames} frames in {folder}; `epirig verify {folder}` checks them\n")
        })
    }
}

impl Capture {
    /// After a scan that did not end: how far it came.
    fn tell_what_stays(&self, talk: &Talk) {
        // A scan that did not even begin has left nothing.
        let Ok(sequence) = Sequence::open(&self.out) else { return };
        let folder = self.out.display();
        let frames = sequence.frames().len();
        talk.say(&format!("{frames} of {} frames were taken; they stay in {folder}", self.frames));
    }
}

/// A scan that cannot end need not begin.
fn refuse_beyond_travel(stage: &dyn Stage, plan: &CapturePlan) -> Result<(), CliError> {
    let travel_mm = stage.travel_mm();
    let beyond = plan.positions_mm.iter().rfind(|position_mm| !(0.0..=travel_mm).contains(*position_mm));
    beyond.map_or(Ok(()), |position_mm| {
        Err(CliError::Usage(format!(
            "the scan would go to {position_mm:.3} mm; the stage goes from 0 to {travel_mm} mm"
        )))
    })
}
