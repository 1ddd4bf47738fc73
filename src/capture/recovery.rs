//! Recovery of the rig in the middle of a scan.

use std::time::Duration;

use tracing::{info, warn};

use super::CaptureError;
use super::archive::Archive;
use super::homing::home;
use super::scan::Scan;
use super::trust::Trust;
use super::watch::Awaited;
use epirig_data::sequence::{Event, ResumedRecord, now};
use epirig_devices::camera::CameraError;
use epirig_devices::stage::{Remedy, StageError};

impl Scan<'_, '_> {
    /// Restores the rig's state as far as it was lost.
    pub(super) fn regain(&mut self, archive: &mut Archive) -> Result<(), CaptureError> {
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
            let settings = Some(&self.settings);
            let attempt = match &mut self.stage {
                Some(stage) => home(&mut **stage, settings),
                None => self.rig.stages.connect().map_err(CaptureError::from).and_then(|mut stage| {
                    self.stop = stage.stop_switch();
                    let homed = home(&mut *stage, settings);
                    self.stage = Some(stage);
                    homed
                }),
            };
            let source = match attempt {
                Ok(_) => break,
                Err(CaptureError::Stage(error)) if !matches!(error, StageError::Stopped { .. }) => error,
                Err(error) => return Err(error),
            };
            warn!(reason = %source, "the stage has not reconnected");
            if self.is_to_end() {
                return Err(CaptureError::Paused);
            }
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
}
