//! The course of a scan: frame by frame, with recovery from failures.

use std::time::Duration;

use tracing::{debug, info, info_span, warn};

use super::archive::Archive;
use super::homing::home;
use super::rig::Rig;
use super::trust::{Trust, lost_trust, may_lose_steps};
use super::{CaptureError, CapturePlan};
use epirig_core::choice::Choice as _;
use epirig_core::frame::Frame;
use epirig_data::sequence::{
    CameraRecord, ClosureRecord, Event, ExitStatus, FrameKind, RetakeRecord, SequenceWriter, StopFacts,
    TimesRecord, now,
};
use epirig_devices::camera::{Camera, Configuration, Moment};
use epirig_devices::stage::{PositionSettings, Stage, StageError, StopSwitch};

/// A frame of the scan that is known to be good.
#[derive(Debug, Clone)]
pub(super) struct GoodFrame {
    pub(super) index: usize,
    pub(super) frame: Frame,
}

/// A scan in progress.
pub(super) struct Scan<'a, 'r> {
    pub(super) rig: &'a mut Rig<'r>,
    /// `None` only while it is connected again.
    pub(super) stage: Option<Box<dyn Stage>>,
    pub(super) stop: StopSwitch,
    pub(super) plan: &'a CapturePlan,
    pub(super) configuration: Configuration,
    /// Of the stage, when the scan began.
    pub(super) settings: PositionSettings,
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
    /// the rig show before anything is written. For a resumed scan, `before` holds the former settings of
    /// camera and stage.
    pub(super) fn begin(
        rig: &'a mut Rig<'r>,
        plan: &'a CapturePlan,
        before: Option<(&CameraRecord, &PositionSettings)>,
    ) -> Result<Self, CaptureError> {
        let first_mm = plan.first_mm()?;
        let mut stage = rig.stages.connect()?;
        plan.check_travel(stage.travel_mm())?;
        let configuration = rig.camera.configure(&plan.camera)?;
        let configuration = match before {
            Some((camera, _)) => set_as_before(rig.camera, configuration, camera)?,
            None => configuration,
        };
        rig.progress.note(&format!("camera set to {configuration}"));
        configuration.notes.iter().for_each(|note| rig.progress.note(&format!("note: {note}")));
        let began = rig.camera.now();
        let settings = home(&mut *stage, before.map(|(_, settings)| settings))?;
        // The first move shows whether the positions can be approached at all, and lets the camera adapt to
        // the scene.
        stage.move_to(first_mm)?;
        rig.camera.start()?;
        if rig.pause.pressed() {
            return Err(if before.is_some() { CaptureError::Paused } else { CaptureError::NotBegun });
        }
        let ready = rig.camera.now();
        debug!(
            positions = plan.positions_mm.len(),
            first_mm,
            settle_s = plan.section.settle.as_secs_f64(),
            averaged = plan.section.average,
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
            settings,
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
        let closed = taken.and_then(|()| self.close());
        self.times.total_s = self.rig.camera.now().since(self.began).as_secs_f64();
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
            self.rig.watcher.rests();
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

    /// Moves to a position from below; an approach from above would add the backlash.
    pub(super) fn go_to(&mut self, position_mm: f64) -> Result<(), CaptureError> {
        let below_mm = below(self.at_mm, position_mm);
        self.at_mm = position_mm;
        if let Some(below_mm) = below_mm {
            debug!(below_mm, position_mm, "approached from below");
            match self.move_to(below_mm) {
                // This stage approaches all positions from below by itself.
                Ok(()) | Err(StageError::NoApproach { .. }) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(self.move_to(position_mm)?)
    }

    /// Moves the stage; if somebody looks on, the camera shows the motion.
    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError> {
        /// The scan goes on at most this much later than without pictures.
        const SLICE: Duration = Duration::from_millis(4);
        // Without a stage, recovery is the next step.
        let stage = self.stage.as_mut().ok_or(StageError::NotHomed)?;
        if !self.rig.watcher.wants_pictures() {
            return stage.move_to(position_mm);
        }
        let (camera, span) = (&mut *self.rig.camera, tracing::Span::current());
        let moved = std::thread::scope(|scope| {
            let moving = || span.in_scope(|| stage.move_to(position_mm));
            let moving = std::thread::Builder::new().spawn_scoped(scope, moving).ok()?;
            while !moving.is_finished() {
                // The next grab meets the same error, and mends what can be mended.
                if camera.show_for(SLICE).is_err() {
                    std::thread::sleep(SLICE);
                }
            }
            Some(moving.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        });
        // Where the system allows no thread, nobody looks on.
        moved.unwrap_or_else(|| stage.move_to(position_mm))
    }

    pub(super) fn stage_now(&mut self) -> Result<&mut Box<dyn Stage>, CaptureError> {
        // Without a stage, recovery is the next step.
        self.stage.as_mut().ok_or(CaptureError::Stage(StageError::NotHomed))
    }

    pub(super) fn camera(&mut self) -> &mut dyn Camera {
        self.rig.camera
    }
}

/// Where the stage goes first on its way from `at_mm` to `position_mm`, in mm from home, if it comes from above:
/// below the position, so that it approaches it as all others.
pub(super) fn below(at_mm: f64, position_mm: f64) -> Option<f64> {
    /// More than the backlash of any usable stage.
    const CLEARANCE_MM: f64 = 1.0;
    (at_mm > position_mm).then_some((position_mm - CLEARANCE_MM).max(0.0))
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
