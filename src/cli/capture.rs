//! `epirig capture`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::plan::PlanOutput;
use super::rig::{RigArguments, tell_configuration};
use super::scan::{Course, Devices, check_room, scan};
use super::{CliError, Talk};
use epirig_data::sequence::refuse_existing;
use epirig_devices::stage::StageSource;

/// Move the stage in steps and take a frame at each stop
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig capture --out seq                                     as rig.toml says
  epirig capture --out seq --rig sim --set plan.frames=21      no hardware needed
  epirig capture --out seq --rig real                          with calibration frames
  epirig capture --out seq --step-mm 1.5 --frames 101          without a profile
  epirig capture --out seq --dry-run                           connects, moves nothing

The stage is homed first and at the end. A frame counts only with its certificate (journal.jsonl);
others are taken again. The first Ctrl-C ends the scan after the current frame, the second stops the
stage. `epirig resume SEQ` continues the scan, also after a power cut. Calibration frames come
first, if the plan has any: dark frames (plan.dark), frames of a uniform target (plan.flat), frames of the
hand-held chess-board of [board] (plan.board). Height in mm needs the focal length.")]
pub(super) struct Capture {
    /// Folder of the new sequence
    #[arg(long, value_name = "SEQ")]
    out: PathBuf,
    /// Connect to the rig and print the plan, without moving anything
    #[arg(long)]
    dry_run: bool,
    /// Begin even if the disk may be too small
    #[arg(long)]
    anyway: bool,
    #[command(flatten)]
    rig: RigArguments,
}

impl Capture {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let profile = self.rig.profile()?;
        let mut devices = Devices::of(&profile, self.rig.stage.transcript(), talk)?;
        refuse_existing(&self.out)?;
        check_room(&mut devices, &self.out, 0, self.anyway, talk)?;
        if self.dry_run {
            let plan = dry_run(devices, talk)?;
            return talk.result(&plan, || plan.describe());
        }
        let captured = scan(devices, &self.out, Course::New, talk)?;
        talk.result(&captured, || format!("{}{}", captured.describe(), captured.next(&self.out, &profile)))
    }
}

/// The plan of a scan with a rig that is connected.
fn dry_run(mut devices: Devices<'_>, talk: &Talk) -> Result<PlanOutput, CliError> {
    let stage = devices.stages.connect()?;
    let configuration = devices.camera.configure(&devices.plan.camera)?;
    tell_configuration(&configuration, talk);
    devices.plan.check_travel(stage.travel_mm())?;
    let frame_bytes = devices.plan.frame_bytes(&configuration);
    let interval: Option<Duration> = configuration.interval.and_then(|interval| interval.duration());
    let estimate = devices.plan.estimate(Some(frame_bytes), interval, |mm| stage.expected_duration(mm));
    Ok(PlanOutput::new(&devices.plan, &estimate))
}
