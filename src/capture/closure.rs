//! Comparison of the rig with its former state: after homing, and at the end of the scan.

use tracing::{info, info_span, warn};

use super::CaptureError;
use super::homing::home;
use super::scan::{GoodFrame, Scan};
use super::settings::listed;
use epirig_calibration::registration::{ShiftError, shift_between};
use epirig_data::sequence::{ClosureRecord, ComparisonRecord};
use epirig_devices::stage::Remedy;

impl Scan<'_, '_> {
    /// Takes a good frame again and compares it with the former one. `None` if it has too little texture to
    /// compare.
    pub(super) fn compare(&mut self, good: &GoodFrame) -> Result<Option<ComparisonRecord>, CaptureError> {
        let found = self.measure_shift(good)?;
        found.as_ref().map_or(Ok(()), |found| self.check_shift(found))?;
        Ok(found)
    }

    /// Refuses a picture that has moved.
    fn check_shift(&self, found: &ComparisonRecord) -> Result<(), CaptureError> {
        let moved_px = found.x_px.hypot(found.y_px);
        let limit_px = self.plan.limits.shift_px;
        if moved_px > limit_px {
            let how =
                format!("the picture has moved by {moved_px:.2} px (limits.shift allows {limit_px} px)");
            return Err(CaptureError::Moved { frame: found.frame, how });
        }
        Ok(())
    }

    fn measure_shift(&mut self, good: &GoodFrame) -> Result<Option<ComparisonRecord>, CaptureError> {
        let position_mm = self.plan.positions_mm[good.index];
        let begun = self.camera().now();
        self.go_to(position_mm)?;
        let arrived = self.camera().now();
        self.times.moving_s += arrived.since(begun).as_secs_f64();
        if !self.camera().is_live() {
            return Ok(None);
        }
        let at_rest = arrived.after(self.plan.section.settle);
        let (again, _) = self.look(at_rest)?;
        self.times.settling_s += self.plan.section.settle.as_secs_f64();
        self.times.exposing_s += self.camera().now().since(at_rest).as_secs_f64();
        match shift_between(&good.frame, &again) {
            // A shift whose sigma exceeds the limit cannot be tested against it.
            Ok(shift) if 3.0 * shift.sigma_px > self.plan.limits.shift_px => Ok(None),
            Ok(shift) => Ok(Some(ComparisonRecord {
                frame: good.index,
                x_px: shift.x_px,
                y_px: shift.y_px,
                sigma_px: shift.sigma_px,
                light: shift.light,
            })),
            Err(ShiftError::TooLittleTexture { .. } | ShiftError::TooSmall { .. }) => Ok(None),
            Err(error) => Err(CaptureError::Moved { frame: good.index, how: error.to_string() }),
        }
    }

    /// Takes the first frame again, by the step count of the scan, and homes the stage once more. This shows
    /// whether the rig has changed. Some stages cannot measure where homing found home, so the picture is
    /// compared.
    ///
    /// All frames exist by then, so a failure of the camera or the line loses only the closure. A stage that
    /// does not home is an error: it may have stood still for long.
    pub(super) fn close(&mut self) -> Result<(), CaptureError> {
        let _span = info_span!("closure").entered();
        let progress = self.rig.progress;
        match self.measure_closure() {
            Ok(()) => Ok(()),
            Err(CaptureError::Moved { frame, how }) => {
                let how = format!("frame {frame} taken again differs from what it was: {how}");
                Err(CaptureError::NotClosed(how))
            }
            Err(CaptureError::SettingsChanged(changes)) => Err(CaptureError::NotClosed(listed(&changes))),
            Err(error) if error.is_wanted() => {
                progress.note("note: stopped after the last frame; the result of homing again is unknown");
                Ok(())
            }
            Err(error) if is_silence(&error) => {
                warn!(reason = %error, "the result of homing again is unknown");
                progress.note(&format!(
                    "note: all frames exist, but the result of homing again is unknown: {error}"
                ));
                Ok(())
            }
            Err(error) => Err(error),
        }
    }

    /// Refuses a scan in which steps were lost or gained although the stage reported no fault.
    pub(super) fn check_home_shift(&self, home_shift_mm: Option<f64>) -> Result<(), CaptureError> {
        let limit_mm = self.plan.limits.position_mm;
        let Some(shift_mm) = home_shift_mm.filter(|shift_mm| shift_mm.abs() > limit_mm) else {
            return Ok(());
        };
        let how = format!(
            "home was found {shift_mm:+.4} mm from where it had been (limits.position allows {limit_mm} mm): steps were lost or gained"
        );
        Err(CaptureError::NotClosed(how))
    }

    /// The result is kept, even if it exceeds the limits.
    fn measure_closure(&mut self) -> Result<(), CaptureError> {
        if self.rig.pause.pressed() {
            return Err(CaptureError::Paused);
        }
        let first = self.first.take().map(|frame| GoodFrame { index: 0, frame });
        let comparison = first.map_or(Ok(None), |first| self.measure_shift(&first))?;
        let settings = self.settings.clone();
        let begun = self.camera().now();
        home(&mut **self.stage_now()?, Some(&settings))?;
        self.times.moving_s += self.camera().now().since(begun).as_secs_f64();
        let home_shift_mm = self.stage_now()?.home_shift_mm();
        let moved_px = comparison.as_ref().map(|found| found.x_px.hypot(found.y_px));
        info!(
            home_shift_mm,
            moved_px,
            light = comparison.as_ref().map(|found| found.light),
            "rig compared with its beginning"
        );
        self.closure = Some(ClosureRecord { home_shift_mm, comparison: comparison.clone() });
        comparison.map_or(Ok(()), |found| self.check_shift(&found))?;
        self.check_home_shift(home_shift_mm)
    }
}

/// Whether the error says nothing about the position of the carriage: camera errors, and a stage that does
/// not answer.
fn is_silence(error: &CaptureError) -> bool {
    match error {
        CaptureError::Camera(_) => true,
        CaptureError::Stage(error) => error.consequence().remedy == Remedy::WaitThenHome,
        _ => false,
    }
}
