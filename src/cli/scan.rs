//! A scan with the rig of a profile: common parts of `capture`, `resume`, `run` and `demo`.

use std::path::Path;

use serde::Serialize;

use super::need::{close_others, refuse_more_than_there_is};
use super::rig::{Hands, Stages};
use super::{CliError, Talk, interrupt, log};
use crate::capture::{self, CapturePlan, PauseSwitch, Rig, Unwatched};
use crate::pipeline::capture_need;
use crate::profile::Profile;
use crate::rig::{capture_plan, open_camera};
use epirig_core::shell::quoted;
use epirig_data::sequence::{ClosureRecord, Event, Sequence, TimesRecord};
use epirig_data::storage::RealDisk;
use epirig_devices::camera::{Camera, OpenCamera, ViewSwitch};

/// The devices of a profile, and the plan for them.
pub(super) struct Devices<'a> {
    pub(super) stages: Stages<'a>,
    pub(super) camera: Box<dyn Camera>,
    /// Selects what a simulated camera sees.
    view: Option<ViewSwitch>,
    pub(super) plan: CapturePlan,
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
            let need = capture_need(size.rows, size.columns, plan.averaged > 1);
            refuse_more_than_there_is("taking frames", need, |available| {
                format!("smaller frames need less (camera.size); or {}", close_others(available))
            })?;
        }
        if profile.camera.is_simulated() && !profile.stage.is_simulated() {
            talk.say("note: the camera is simulated, and shows the object at the position that the stage reports: a rehearsal");
        }
        let stages = Stages::new(profile, transcript, talk)?;
        let OpenCamera { camera, view } = open_camera(profile, &stages.watch())?;
        Ok(Self { stages, camera, view, plan })
    }
}

/// Whether a scan is new or resumed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Course {
    New,
    Resumed,
}

/// The result of a scan.
#[derive(Debug, Serialize)]
pub(super) struct Captured {
    pub(super) folder: String,
    pub(super) frames: usize,
    pub(super) retakes: usize,
    pub(super) closure: Option<ClosureRecord>,
    pub(super) times: Option<TimesRecord>,
}

/// Takes the missing frames of the sequence in `folder`.
pub(super) fn scan(
    mut devices: Devices<'_>,
    folder: &Path,
    course: Course,
    talk: &Talk,
) -> Result<Captured, CliError> {
    log::beside(folder, course == Course::Resumed);
    let pause = PauseSwitch::default();
    interrupt::pauses(pause.clone());
    let mut rig = Rig {
        stages: &mut devices.stages,
        camera: &mut *devices.camera,
        assistant: &mut Hands::new(talk, devices.view.clone()),
        pause,
        progress: talk,
        watcher: &Unwatched,
    };
    let before = Sequence::open(folder).map_or(0, |sequence| sequence.frames().len());
    let taken = match course {
        Course::New => capture::capture(&mut rig, &devices.plan, folder, Box::new(RealDisk)),
        Course::Resumed => capture::resume(&mut rig, &devices.plan, folder, Box::new(RealDisk)),
    };
    // Work after the scan ends at the first Ctrl-C.
    interrupt::stops_nothing();
    let closure = taken?;
    let sequence = Sequence::open(folder)?;
    if sequence.frames().len() > before && folder.join("results").exists() {
        let folder = quoted(folder);
        talk.say(&format!(
            "note: {folder}/results were made from fewer frames; run `epirig match {folder} --overwrite` again"
        ));
    }
    Ok(Captured {
        folder: folder.display().to_string(),
        frames: sequence.frames().len(),
        retakes: sequence.events().iter().filter(|event| matches!(event, Event::Retake(_))).count(),
        closure,
        times: sequence.stop().and_then(|stop| stop.times),
    })
}

impl Captured {
    /// The result as text.
    pub(super) fn describe(&self) -> String {
        let Self { folder, frames, .. } = self;
        let retakes = match self.retakes {
            0 => String::new(),
            1 => ", 1 attempt failed and was repeated".to_owned(),
            count => format!(", {count} attempts failed and were repeated"),
        };
        let home = self.closure.as_ref().and_then(|closure| closure.home_shift_mm);
        let home = home
            .map_or(String::new(), |shift_mm| format!("home found again within {:.4} mm; ", shift_mm.abs()));
        let picture = self.closure.as_ref().and_then(|closure| closure.comparison.as_ref());
        let picture = picture.map_or(String::new(), |found| {
            let moved_px = found.x_px.hypot(found.y_px);
            format!(
                "the first frame, taken again, has moved by {moved_px:.4} px (sigma {:.4}), its light by {:+.2} %",
                found.sigma_px,
                100.0 * (found.light - 1.0)
            )
        });
        let closing = match home + &picture {
            none if none.is_empty() => "no check of lost steps was possible".to_owned(),
            words => words,
        };
        let time = self.times.as_ref().map_or(String::new(), |times| {
            let overhead = times
                .overhead()
                .map_or(String::new(), |overhead| format!(", {overhead:.3} of what stage and camera need"));
            format!(
                "took {:.1} s (moving {:.1} s, settling {:.1} s, exposing {:.1} s){overhead}\n",
                times.total_s, times.moving_s, times.settling_s, times.exposing_s
            )
        });
        let named = quoted(Path::new(folder));
        format!(
            "{frames} frames in {folder}{retakes}\n{time}closing: {closing}\n`epirig verify {named}` checks them, `epirig match \
             {named}` measures with them\n"
        )
    }
}
