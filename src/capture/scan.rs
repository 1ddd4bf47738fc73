//! The course of a scan: frame by frame, with recovery from failures.

use std::time::Duration;

use tracing::{debug, info, info_span, warn};

use super::archive::Archive;
use super::rig::Rig;
use super::watch::Awaited;
use super::{CaptureError, CapturePlan};
use epirig_core::frame::Frame;
use epirig_data::sequence::{
    CameraRecord, ClosureRecord, Event, ExitStatus, FrameKind, ResumedRecord, RetakeRecord, SequenceWriter,
    StopFacts, TimesRecord, now,
};
use epirig_devices::camera::{Camera, CameraError, CameraRemedy, Configuration, Moment};
use epirig_devices::stage::{PositionAfter, Remedy, Stage, StageError, StopSwitch};

/// A frame of the scan that is known to be good.
#[derive(Debug, Clone)]
pub(super) struct GoodFrame {
    pub(super) index: usize,
    pub(super) frame: Frame,
}

/// How much of the rig's state is still valid, in falling order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Trust {
    /// Everything is as for the latest frame.
    Whole,
    /// The camera must be started again.
    CameraStopped,
    /// The position is lost.
    PositionLost,
    /// The camera was disconnected. The position counts as lost too, because the cable may have moved the
    /// carriage.
    CameraGone,
}

/// A scan in progress.
pub(super) struct Scan<'a, 'r> {
    pub(super) rig: &'a mut Rig<'r>,
    /// `None` only while it is connected again.
    pub(super) stage: Option<Box<dyn Stage>>,
    pub(super) stop: StopSwitch,
    pub(super) plan: &'a CapturePlan,
    pub(super) configuration: Configuration,
    pub(super) trust: Trust,
    /// Why the state was lost, in words.
    pub(super) lost_by: String,
    /// The last commanded position, in mm from home.
    pub(super) at_mm: f64,
    /// Whether a known event explains lost steps found by homing.
    pub(super) steps_in_doubt: bool,
    /// The frame before the current one.
    pub(super) latest: Option<GoodFrame>,
    /// The first frame of the scan.
    pub(super) first: Option<Frame>,
    /// Results at the end of the scan, as far as it came.
    pub(super) closure: Option<ClosureRecord>,
    pub(super) times: TimesRecord,
    pub(super) began: Moment,
}

impl<'a, 'r> Scan<'a, 'r> {
    /// Connects to the rig, sets up the camera, homes the stage and moves to the first position. So faults of
    /// the rig show before anything is written. For a resumed scan, `before` holds the former camera
    /// settings.
    pub(super) fn begin(
        rig: &'a mut Rig<'r>,
        plan: &'a CapturePlan,
        before: Option<&CameraRecord>,
    ) -> Result<Self, CaptureError> {
        let first_mm = plan.first_mm()?;
        let mut stage = rig.stages.connect()?;
        plan.check_travel(stage.travel_mm())?;
        let configuration = rig.camera.configure(&plan.camera)?;
        let configuration = match before {
            Some(before) => set_as_before(rig.camera, configuration, before)?,
            None => configuration,
        };
        rig.progress.note(&format!("camera set to {configuration}"));
        configuration.notes.iter().for_each(|note| rig.progress.note(&format!("note: {note}")));
        let began = rig.camera.now();
        stage.home()?;
        // The first move shows whether the positions can be approached at all, and lets the camera adapt to
        // the scene.
        stage.move_to(first_mm)?;
        rig.camera.start()?;
        if rig.pause.pressed() {
            return Err(CaptureError::Paused);
        }
        let ready = rig.camera.now();
        debug!(
            positions = plan.positions_mm.len(),
            first_mm,
            settle_s = plan.settle.as_secs_f64(),
            averaged = plan.averaged,
            resumed = before.is_some(),
            "rig ready"
        );
        let times = TimesRecord { moving_s: ready.since(began).as_secs_f64(), ..TimesRecord::default() };
        Ok(Self {
            rig,
            stop: stage.stop_switch(),
            stage: Some(stage),
            plan,
            configuration,
            trust: Trust::Whole,
            lost_by: String::new(),
            at_mm: first_mm,
            steps_in_doubt: false,
            latest: None,
            first: None,
            closure: None,
            times,
            began,
        })
    }

    /// Takes these frames, closes the scan and writes the end record.
    pub(super) fn finish(
        mut self,
        writer: SequenceWriter,
        indices: &[usize],
        prepare: impl FnOnce(&mut Self, &mut Archive) -> Result<(), CaptureError>,
    ) -> Result<Option<ClosureRecord>, CaptureError> {
        let mut archive = Archive::new(writer);
        self.rig.progress.begin("capturing", indices.len() as u64);
        let taken = prepare(&mut self, &mut archive)
            .and_then(|()| self.frames(indices, &mut archive))
            .and_then(|()| Ok(archive.flush()?));
        self.rig.progress.end();
        let total = self.rig.camera.now().since(self.began);
        self.times.total_s = total.as_secs_f64();
        let closed = taken.and_then(|()| self.close());
        // A disconnected camera needs no stop.
        let _ = self.rig.camera.stop();
        let status = match &closed {
            Ok(()) => ExitStatus::Complete,
            Err(CaptureError::NotClosed { .. }) => ExitStatus::NotClosed,
            Err(error) if error.is_wanted() => ExitStatus::Aborted,
            Err(_) => ExitStatus::Failed,
        };
        let reason = closed.as_ref().err().map(ToString::to_string);
        let TimesRecord { total_s, moving_s, settling_s, exposing_s } = self.times;
        info!(exit_status = status.name(), reason, total_s, moving_s, settling_s, exposing_s, "scan ended");
        let facts = StopFacts { reason, closure: self.closure.clone(), times: Some(self.times) };
        let finished = archive.finish(status, facts);
        closed?;
        finished?;
        Ok(self.closure)
    }

    fn frames(&mut self, indices: &[usize], archive: &mut Archive) -> Result<(), CaptureError> {
        for (position, &index) in indices.iter().enumerate() {
            if position > 0 && self.rig.pause.pressed() {
                info!(next = index, "paused");
                return Err(CaptureError::Paused);
            }
            self.frame(index, archive)?;
            self.rig.progress.advance(1);
        }
        Ok(())
    }

    /// Takes a frame; repeats it if it is not good.
    fn frame(&mut self, index: usize, archive: &mut Archive) -> Result<(), CaptureError> {
        let mut attempt = 1;
        loop {
            let _span = info_span!("frame", index, attempt).entered();
            let taken = self.regain(archive).and_then(|()| self.step(index, attempt));
            let error = match taken {
                Ok((frame, facts)) => {
                    self.rig.watcher.frame(FrameKind::Scan, index, &frame, &facts);
                    archive.frame(FrameKind::Scan, index, frame.clone(), facts)?;
                    if index == 0 {
                        self.first = Some(frame.clone());
                    }
                    self.latest = Some(GoodFrame { index, frame });
                    return Ok(());
                }
                Err(error) => error,
            };
            let Some(lost) = lost_trust(&error) else {
                debug!(reason = %error, "another attempt would not help");
                return Err(error);
            };
            warn!(reason = %error, ?lost, "the frame is taken again");
            if lost > self.trust {
                self.trust = lost;
            }
            self.lost_by = error.to_string();
            self.steps_in_doubt |= may_lose_steps(&error);
            self.rig.progress.note(&format!("frame {index}, attempt {attempt}: {error}"));
            let reason = error.to_string();
            self.rig.watcher.failed(index, attempt, &reason);
            archive.note(Event::Retake(RetakeRecord { index, attempt, reason, at: now() }))?;
            if attempt > self.plan.limits.retakes {
                return Err(CaptureError::RetriesExhausted {
                    index,
                    attempts: attempt,
                    source: Box::new(error),
                });
            }
            attempt += 1;
        }
    }

    /// Restores the rig's state as far as it was lost.
    fn regain(&mut self, archive: &mut Archive) -> Result<(), CaptureError> {
        if self.trust != Trust::Whole {
            warn!(lost = ?self.trust, reason = self.lost_by, steps_in_doubt = self.steps_in_doubt, "recovering the rig");
        }
        match self.trust {
            Trust::Whole => return Ok(()),
            Trust::CameraStopped => {
                self.rig.camera.start()?;
                self.trust = Trust::Whole;
                return Ok(());
            }
            Trust::CameraGone => {
                self.rig.watcher.waits_for(Some(Awaited::Camera));
                let back = self.wait_for_camera();
                self.rig.watcher.waits_for(None);
                back?;
                self.trust = Trust::PositionLost;
            }
            Trust::PositionLost => {}
        }
        let back = self.wait_for_stage();
        self.rig.watcher.waits_for(None);
        back?;
        if !self.steps_in_doubt {
            // Steps were lost before, and frames have been taken since.
            let home_shift_mm = self.stage_now()?.home_shift_mm();
            self.check_home_shift(home_shift_mm)?;
        }
        // An error of the archive may have ended it meanwhile.
        self.rig.camera.start()?;
        let after = std::mem::take(&mut self.lost_by);
        let resumed = self.go_on(after)?;
        archive.note(Event::Resumed(resumed))?;
        Ok(())
    }

    /// With a known position: compares the last good frame with one taken there now.
    pub(super) fn go_on(&mut self, after: String) -> Result<ResumedRecord, CaptureError> {
        let home_shift_mm = self.stage_now()?.home_shift_mm();
        let latest = self.latest.take();
        let comparison = latest.as_ref().map(|good| self.compare(good)).transpose();
        self.latest = latest;
        let comparison = comparison?.flatten();
        (self.trust, self.steps_in_doubt) = (Trust::Whole, false);
        let words = comparison.as_ref().map_or_else(
            || "there is no frame to compare".to_owned(),
            |found| {
                let moved_px = found.x_px.hypot(found.y_px);
                format!("frame {} taken again has moved by {moved_px:.3} px", found.frame)
            },
        );
        let moved_px = comparison.as_ref().map(|found| found.x_px.hypot(found.y_px));
        info!(after, home_shift_mm, moved_px, "the scan continues");
        self.rig.progress.note(&format!("the scan continues: the stage is homed; {words}"));
        let position_tolerance_mm = Some(self.plan.limits.position_mm);
        Ok(ResumedRecord { after, home_shift_mm, comparison, position_tolerance_mm, at: now() })
    }

    fn wait_for_camera(&mut self) -> Result<(), CaptureError> {
        /// Longest delay until a pause is noticed.
        const SLICE: Duration = Duration::from_secs(1);
        let wait = self.plan.limits.wait;
        warn!(seconds = wait.as_secs_f64(), "waiting for the camera");
        self.rig.progress.note(&format!("waiting up to {:.0} s for the camera", wait.as_secs_f64()));
        let until = self.rig.camera.now().after(wait);
        loop {
            let left = until.since(self.rig.camera.now());
            match self.rig.camera.reconnect(SLICE.min(left)) {
                Err(CameraError::ReconnectTimeout { .. }) if self.is_to_end() => {
                    return Err(CaptureError::Paused);
                }
                Err(CameraError::ReconnectTimeout { .. }) if left > SLICE => {}
                Err(CameraError::ReconnectTimeout { camera, why, .. }) => {
                    return Err(CameraError::ReconnectTimeout { camera, patience: wait, why }.into());
                }
                done => return Ok(done?),
            }
        }
    }

    /// Homes the stage; connects to it again if that fails.
    fn wait_for_stage(&mut self) -> Result<(), CaptureError> {
        /// Pause between two attempts to connect to a stage.
        const PAUSE: Duration = Duration::from_millis(500);
        let wait = self.plan.limits.wait;
        let until = std::time::Instant::now() + wait;
        let (mut told, mut in_vain) = (false, 0);
        let before = self.rig.camera.now();
        loop {
            let attempt = match &mut self.stage {
                Some(stage) => stage.home(),
                None => self.rig.stages.connect().and_then(|mut stage| {
                    self.stop = stage.stop_switch();
                    let homed = stage.home();
                    self.stage = Some(stage);
                    homed
                }),
            };
            let source = match attempt {
                Ok(()) => break,
                Err(error @ StageError::Stopped { .. }) => return Err(error.into()),
                Err(error) => error,
            };
            warn!(reason = %source, "the stage has not reconnected");
            if source.consequence().remedy != Remedy::WaitThenHome {
                // A motor that runs against its end again and again will not recover.
                in_vain += 1;
                if in_vain > self.plan.limits.retakes {
                    return Err(CaptureError::CannotHome { attempts: in_vain, source });
                }
            }
            if !std::mem::replace(&mut told, true) {
                self.rig.watcher.waits_for(Some(Awaited::Stage));
                let wait_s = wait.as_secs_f64();
                self.rig.progress.note(&format!("waiting up to {wait_s:.0} s for the stage: {source}"));
            }
            if self.is_to_end() {
                return Err(CaptureError::Paused);
            }
            if std::time::Instant::now() >= until {
                return Err(CaptureError::StageReconnectTimeout { wait_s: wait.as_secs_f64(), source });
            }
            // The port must be closed before it can be opened again.
            self.stage = None;
            std::thread::sleep(PAUSE);
        }
        self.at_mm = 0.0;
        self.times.moving_s += self.rig.camera.now().since(before).as_secs_f64();
        Ok(())
    }

    fn is_to_end(&self) -> bool {
        self.rig.pause.pressed() || self.stop.pressed().is_some()
    }

    /// Moves to a position from below; an approach from above would add the backlash.
    pub(super) fn go_to(&mut self, position_mm: f64) -> Result<(), CaptureError> {
        /// More than the backlash of any usable stage.
        const CLEARANCE_MM: f64 = 1.0;
        let from_above = self.at_mm > position_mm;
        if from_above {
            debug!(from_mm = self.at_mm, position_mm, "approached from below");
        }
        self.at_mm = position_mm;
        let stage = self.stage_now()?;
        if from_above {
            match stage.move_to((position_mm - CLEARANCE_MM).max(0.0)) {
                // This stage approaches all positions from below by itself.
                Ok(()) | Err(StageError::NoApproach { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(stage.move_to(position_mm)?)
    }

    pub(super) fn stage_now(&mut self) -> Result<&mut Box<dyn Stage>, CaptureError> {
        // Without a stage, recovery is the next step.
        self.stage.as_mut().ok_or(CaptureError::Stage(StageError::NotHomed))
    }

    pub(super) fn camera(&mut self) -> &mut dyn Camera {
        self.rig.camera
    }
}

/// Restores all controls, also those not in the plan: a camera that was without power has its defaults.
fn set_as_before(
    camera: &mut dyn Camera,
    mut configuration: Configuration,
    before: &CameraRecord,
) -> Result<Configuration, CaptureError> {
    for pinned in &mut configuration.pinned {
        let wanted = before.controls.get(&pinned.name).filter(|wanted| **wanted != pinned.value);
        if let Some(wanted) = wanted {
            info!(
                control = pinned.name,
                was = pinned.value,
                now = wanted,
                "control set as before the interruption"
            );
            camera.set_control(&pinned.name, &wanted.to_string())?;
            pinned.value = *wanted;
            // A control that depends on another one cannot be set.
            configuration.exposure_us = before.exposure_us;
        }
    }
    Ok(configuration)
}

/// Whether the event behind an error may have cost steps.
fn may_lose_steps(error: &CaptureError) -> bool {
    match error {
        CaptureError::Stage(error) => error.consequence().position != PositionAfter::Unsure,
        CaptureError::NoMotion { .. } => true,
        _ => false,
    }
}

/// What an error leaves of the rig's state; `None` if another attempt cannot help.
pub(super) fn lost_trust(error: &CaptureError) -> Option<Trust> {
    match error {
        CaptureError::Stage(error) => match error.consequence().remedy {
            Remedy::AnotherOrder => None,
            Remedy::HomeAgain | Remedy::WaitThenHome => Some(Trust::PositionLost),
        },
        CaptureError::NoMotion { .. } => Some(Trust::PositionLost),
        CaptureError::Camera(error) => match error.remedy() {
            CameraRemedy::AnotherOrder => None,
            CameraRemedy::StartAnew => Some(Trust::CameraStopped),
            CameraRemedy::Reconnect => Some(Trust::CameraGone),
        },
        CaptureError::Saturated { .. } | CaptureError::LightChanged { .. } => Some(Trust::Whole),
        _ => None,
    }
}
