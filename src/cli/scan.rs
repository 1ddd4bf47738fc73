//! A scan with the rig of a profile: common parts of `capture`, `resume`, `run` and `demo`.

use std::path::Path;

use serde::Serialize;

use super::need::{close_others, refuse_more_than_there_is};
use super::rig::{Hands, Stages};
use super::{CliError, Talk, log};
use crate::calibrate::CALIBRATION;
use crate::capture::{self, CapturePlan, PauseSwitch, Rig};
use crate::doctor::{Verdict, check_disk};
use crate::pipeline::capture_need;
use crate::profile::Profile;
use crate::rig::{can_be_calibrated, capture_plan, open_camera};
use epirig_core::fault::Blame;
use epirig_core::shell::quoted;
use epirig_data::sequence::{ClosureRecord, Event, Sequence, TimesRecord};
use epirig_data::storage::{RealDisk, free_bytes};
use epirig_devices::camera::{Camera, OpenCamera, ViewSwitch};

/// Usual folder of the results in that of a sequence.
pub(super) const RESULTS: &str = "results";

/// The devices of a profile, and the plan for them.
pub(super) struct Devices<'a> {
    pub(super) stages: Stages<'a>,
    pub(super) camera: Box<dyn Camera>,
    /// Selects what a simulated camera sees.
    view: Option<ViewSwitch>,
    pub(super) plan: CapturePlan,
    simulated_time: bool,
}

impl<'a> Devices<'a> {
    pub(super) fn of(
        profile: &'a Profile,
        transcript: Option<&Path>,
        talk: &'a Talk,
    ) -> Result<Self, CliError> {
        let plan = capture_plan(profile)?;
        // If the camera chooses the size, its own buffers have room for it.
        if let Some(size) = profile.camera.size {
            let need = capture_need(size.rows, size.columns, plan.section.average > 1);
            refuse_more_than_there_is("taking frames", need, |available| {
                format!("smaller frames need less (camera.size); or {}", close_others(available))
            })?;
        }
        if profile.camera.is_simulated() && !profile.stage.is_simulated() {
            talk.say("note: the camera is simulated, and shows the object at the position that the stage reports: a rehearsal");
        }
        let stages = Stages::new(profile, transcript, talk)?;
        let OpenCamera { camera, view } = open_camera(profile, &stages.stage.watch())?;
        let simulated_time =
            profile.camera.is_simulated() && profile.stage.is_simulated() && !profile.sim.real_time;
        Ok(Self { stages, camera, view, plan, simulated_time })
    }
}

/// Whether a scan is new or resumed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Course {
    New,
    Resumed,
}

#[derive(Debug, Serialize)]
pub(super) struct Captured {
    pub(super) folder: String,
    pub(super) frames: usize,
    /// Frames that were taken now: fewer than `frames` if a scan was resumed.
    pub(super) taken: usize,
    pub(super) retakes: usize,
    pub(super) closure: Option<ClosureRecord>,
    pub(super) times: Option<TimesRecord>,
    /// Whether `times` are those of a simulated rig, whose clock is faster than a real one.
    pub(super) simulated_time: bool,
}

/// Takes the missing frames of the sequence in `folder`.
pub(super) fn scan(
    mut devices: Devices<'_>,
    folder: &Path,
    course: Course,
    talk: &Talk,
) -> Result<Captured, CliError> {
    let simulated_time = devices.simulated_time;
    log::beside(folder, course == Course::Resumed);
    let pause = PauseSwitch::default();
    if let Some(switches) = talk.switches() {
        switches.pauses(pause.clone());
    }
    let mut rig = Rig {
        stages: &mut devices.stages,
        camera: &mut *devices.camera,
        assistant: &mut Hands { talk, view: devices.view.clone() },
        pause,
        progress: talk,
        watcher: talk,
    };
    let before = Sequence::open(folder).map_or(0, |sequence| sequence.frames().len());
    let taken = match course {
        Course::New => capture::capture(&mut rig, &devices.plan, folder, Box::new(RealDisk)),
        Course::Resumed => capture::resume(&mut rig, &devices.plan, folder, Box::new(RealDisk)),
    };
    // Work after the scan ends at the first Ctrl-C.
    if let Some(switches) = talk.switches() {
        switches.clear();
    }
    let closure = taken?;
    let sequence = Sequence::open(folder)?;
    Ok(Captured {
        folder: folder.display().to_string(),
        frames: sequence.frames().len(),
        taken: sequence.frames().len().saturating_sub(before),
        retakes: sequence.events().iter().filter(|event| matches!(event, Event::Retake(_))).count(),
        closure,
        times: sequence.stop().and_then(|stop| stop.times),
        simulated_time,
    })
}

impl Captured {
    pub(super) fn describe(&self) -> String {
        let Self { folder, frames, .. } = self;
        let retakes = match self.retakes {
            0 => String::new(),
            1 => ", 1 attempt failed and was repeated".to_owned(),
            count => format!(", {count} attempts failed and were repeated"),
        };
        let time = self.times.as_ref().map_or(String::new(), |times| took(times, self.simulated_time));
        format!("{frames} frames in {folder}{retakes}\n{time}check at the end   {}\n", self.check())
    }

    /// Whether the rig was at the end as at the beginning.
    fn check(&self) -> String {
        let home_mm = self.closure.as_ref().and_then(|closure| closure.home_shift_mm).map(f64::abs);
        let home = home_mm.map(|shift_mm| match shift_mm >= LEAST_MM {
            true => format!("home was found {shift_mm:.4} mm from where it had been"),
            false => "home was found where it had been".to_owned(),
        });
        let compared = self.closure.as_ref().and_then(|closure| closure.comparison.as_ref());
        let picture = compared.map(|found| {
            let moved_px = found.x_px.hypot(found.y_px);
            let light = match 100.0 * (found.light - 1.0) {
                change if change.abs() >= LEAST_PERCENT => {
                    format!(", its light has changed by {change:+.2} %")
                }
                _ => String::new(),
            };
            match moved_px >= LEAST_PX {
                true => format!(
                    "the first frame, taken again, has moved by {moved_px:.4} px (sigma {:.4}){light}",
                    found.sigma_px
                ),
                false => format!("the first frame, taken again, has not moved{light}"),
            }
        });
        let found: Vec<String> = home.into_iter().chain(picture).collect();
        match found.is_empty() {
            true => {
                "whether steps were lost is not known: neither the stage nor the picture tells".to_owned()
            }
            false => found.join("; "),
        }
    }

    /// The commands that come next for the sequence in `folder`, none of which would be refused.
    pub(super) fn next(&self, folder: &Path, profile: &Profile) -> String {
        let (named, has_results) = (quoted(folder), folder.join(RESULTS).exists());
        if self.taken == 0 && has_results {
            return format!("`epirig view {named}` shows its results\n");
        }
        let stale = if has_results { "the results there are those of fewer frames\n" } else { "" };
        let again = if folder.join(CALIBRATION).exists() { " --overwrite" } else { "" };
        let calibrate = match can_be_calibrated(profile) {
            true => format!("`epirig calibrate {named}{again}`, then "),
            false => String::new(),
        };
        let matched = match_command(folder);
        format!("{stale}next: {calibrate}{matched}; `epirig verify {named}` checks the frames\n")
    }
}

/// The command that matches the sequence in a folder, also if it has results.
pub(super) fn match_command(folder: &Path) -> String {
    let again = if folder.join(RESULTS).exists() { " --overwrite" } else { "" };
    format!("`epirig match {}{again}`", quoted(folder))
}

/// Less than this is shown as nothing: the digits that are printed.
const LEAST_MM: f64 = 5e-5;
const LEAST_PX: f64 = 5e-5;
const LEAST_PERCENT: f64 = 5e-3;

/// Where the time went.
fn took(times: &TimesRecord, is_simulated: bool) -> String {
    /// A share that a person would want to know of.
    const MUCH: f64 = 1.05;
    let clock = if is_simulated { " by the clock of the simulated rig" } else { "" };
    let needed_s = times.moving_s + times.settling_s + times.exposing_s;
    let waited = match times.overhead() {
        Some(overhead) if overhead > MUCH => {
            format!(", waiting for the program {:.1} s", times.total_s - needed_s)
        }
        _ => String::new(),
    };
    format!(
        "took {:.1} s{clock}: moving {:.1} s, settling {:.1} s, exposing {:.1} s{waited}\n",
        times.total_s, times.moving_s, times.settling_s, times.exposing_s
    )
}

/// Says if the disk is short for the frames of a plan, of which `present` exist; refuses it if it is too small,
/// unless `anyway`.
pub(super) fn check_room(
    devices: &mut Devices<'_>,
    folder: &Path,
    present: usize,
    anyway: bool,
    talk: &Talk,
) -> Result<(), CliError> {
    let configuration = devices.camera.configure(&devices.plan.camera)?;
    let check = check_disk(&devices.plan, present, free_bytes(folder), &configuration);
    let words = format!("{}: {}", check.finding, check.advice.unwrap_or_default());
    match check.verdict {
        Verdict::Bad if !anyway => Err(CliError::new(
            Blame::System,
            format!("{words}, or begin with --anyway: PNG often takes less"),
        )),
        Verdict::Bad | Verdict::Warning => {
            talk.say(&format!("warning: {words}"));
            Ok(())
        }
        Verdict::Good | Verdict::Unknown => Ok(()),
    }
}
