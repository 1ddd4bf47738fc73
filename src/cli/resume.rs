//! `epirig resume`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::match_arguments::MatchArguments;
use super::need::{check_match, frames_of};
use super::rig::{given, given_by_set};
use super::run::{Existing, measure_captured};
use super::scan::{Captured, Course, Devices, check_room, scan};
use super::verdict::VerdictArguments;
use super::verify::refuse_another_rig;
use super::{CliError, Talk};
use crate::profile::{Override, Profile};
use crate::rig::can_be_calibrated;
use epirig_data::sequence::{FrameKind, Origin, Sequence, refuse_busy};
use epirig_matcher::MatchOptions;

/// Continue an interrupted scan
#[derive(Debug, Args)]
#[command(mut_group("MatchArguments", |options| options.requires("measure")))]
#[command(mut_group("VerdictArguments", |options| options.requires("measure")))]
#[command(after_help = "Examples:
  epirig resume seq
  epirig resume seq --measure                  measures then, as `epirig run` does
  epirig resume seq --port /dev/ttyUSB1        the stage has another port now

The rig is that of the scan (sequence.json). Existing frames are checked, the stage is homed, and
the last good frame is taken again and compared. If the picture has moved, the scan does not continue.
Else the missing frames are taken. With --measure, a calibration and results that exist are replaced,
and a scan that is complete is measured at once.")]
pub(super) struct Resume {
    /// Folder of the sequence
    #[arg(value_name = "SEQ")]
    sequence: PathBuf,
    /// The stage's port, if it has changed: a path, usb:SERIAL or usb:VID:PID
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// The camera's name, if it has changed: a path, a name in /dev/v4l/by-id, usb:SERIAL
    #[arg(long, value_name = "CAMERA")]
    camera: Option<String>,
    /// Change a limit of the scan, or the number of dark, flat or board frames: --set limits.shift="0.2 px"
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Calibrate, match and measure the surface then, as `epirig run` does
    #[arg(long)]
    measure: bool,
    #[command(flatten)]
    verdict: VerdictArguments,
    #[command(flatten)]
    matching: MatchArguments,
}

impl Resume {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        self.verdict.check()?;
        let profile = self.recorded()?;
        let port = given("stage.port", "--port", self.port.as_ref());
        let camera = given("camera.device", "--camera", self.camera.as_ref());
        let set = given_by_set(&self.set)?;
        set.iter().try_for_each(refuse_another_scan)?;
        let changes: Vec<Override> = port.into_iter().chain(camera).chain(set).collect();
        let was_simulated = profile.stage.is_simulated();
        let profile = profile.changed(&changes)?;
        match (self.port.is_some(), was_simulated, profile.stage.is_simulated()) {
            (true, true, _) => {
                return Err(CliError::usage("the stage of this scan is simulated; omit --port".to_owned()));
            }
            (true, false, true) => {
                let why = "the stage of this scan is a real one, and sim a simulated one; give the port of the real one";
                return Err(CliError::usage(why.to_owned()));
            }
            _ => {}
        }
        let options = self.matching.options();
        let captured = resumed_scan(&profile, &self.sequence, self.measure.then_some(&options), talk)?;
        if self.measure {
            // A calibration and results that exist are those of fewer frames.
            return measure_captured(
                &captured,
                &self.sequence,
                &profile,
                (&options, Existing::Replaced),
                &self.verdict,
                talk,
            );
        }
        talk.result(&captured, || {
            format!("{}{}", captured.describe(), captured.next(&self.sequence, &profile))
        })
    }

    /// The profile recorded when the scan began.
    fn recorded(&self) -> Result<Profile, CliError> {
        let sequence = Sequence::open(&self.sequence)?;
        let folder = self.sequence.display();
        let profile = match sequence.record().origin {
            Origin::Captured { .. } => Profile::of_sequence(&sequence)?,
            Origin::Imported { .. } | Origin::Rectified { .. } => None,
        };
        let profile = profile.ok_or_else(|| {
            CliError::usage(format!("{folder} was not made by `epirig capture`; it cannot be resumed"))
        })?;
        refuse_another_rig(&sequence, &profile)?;
        Ok(profile)
    }
}

/// Takes the frames that the sequence in `folder` lacks, with the rig of a profile; and checks before that all of them can
/// be matched with `options`, if they will be.
pub(super) fn resumed_scan(
    profile: &Profile,
    folder: &Path,
    options: Option<&MatchOptions>,
    talk: &Talk,
) -> Result<Captured, CliError> {
    let mut devices = Devices::of(profile, None, talk)?;
    let sequence = Sequence::open(folder)?;
    if let Some(options) = options {
        // A wrong option is reported before the scan.
        let mut frames = frames_of(&sequence, None);
        frames.count = devices.plan.positions_mm.len();
        frames.sample_bytes = if can_be_calibrated(profile) { 2 } else { frames.sample_bytes };
        options.check(frames.rows, frames.columns, frames.count)?;
        check_match(frames, options, None, talk)?;
    }
    let others = FrameKind::CALIBRATION.map(|kind| sequence.calibration_frames(kind).len());
    let present = sequence.frames().len() + others.iter().sum::<usize>();
    if present < devices.plan.positions_mm.len() + devices.plan.calibration_frames() {
        refuse_busy(folder)?;
        // A frame that does not fit stops the scan without loss, so a small disk is no reason to refuse.
        check_room(&mut devices, folder, present, true, talk)?;
    }
    scan(devices, folder, Course::Resumed, talk)
}

/// Refuses a change that is not allowed during a scan.
fn refuse_another_scan(change: &Override) -> Result<(), CliError> {
    let key = &change.key;
    if key.starts_with("limits.") || matches!(key.as_str(), "plan.dark" | "plan.flat" | "plan.board") {
        return Ok(());
    }
    // A key that does not exist is reported as such.
    Profile::of(std::slice::from_ref(change))?;
    Err(CliError::usage(format!(
        "{key} cannot change in the middle of a scan; limits, plan.dark, plan.flat and plan.board can"
    )))
}
