//! Comparing the rig with what it was: after homing, and at the end.

use super::CaptureError;
use super::error::is_unheard;
use super::scan::{GoodFrame, Scan};
use epirig_calibration::registration::{ShiftError, shift_between};
use epirig_data::sequence::{ClosureRecord, ComparisonRecord};

impl Scan<'_, '_> {
    /// Takes a good frame again and compares it with what it was. `None` if it shows too little to tell.
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
        self.go_to(position_mm)?;
        if !self.camera().is_live() {
            return Ok(None);
        }
        let at_rest = self.camera().now().after(self.plan.settle);
        let (again, _) = self.look(at_rest)?;
        match shift_between(&good.frame, &again) {
            // A shift that is known worse than the limit cannot be held to it.
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

    /// Takes the first frame again, by the count of steps that the scan has kept, and homes the stage once more: whether the rig
    /// stayed what it was. Some stages cannot tell where homing finds home, so the picture has to.
    ///
    /// All frames are there by then, so a camera that fails now, or a line, costs the closure only. A stage that does not come home is
    /// another matter: perhaps it has not moved for long.
    pub(super) fn close(&mut self) -> Result<(), CaptureError> {
        let progress = self.rig.progress;
        match self.measure_closure() {
            Ok(()) => Ok(()),
            Err(CaptureError::Moved { frame, how }) => {
                let how = format!("frame {frame} taken again differs from what it was: {how}");
                Err(CaptureError::NotClosed { how })
            }
            Err(error) if error.is_wanted() => {
                progress.note("note: stopped after the last frame; what re-homing would show is not known");
                Ok(())
            }
            Err(error) if is_silence(&error) => {
                progress.note(&format!(
                    "note: all frames are there, but what re-homing would show is not known: {error}"
                ));
                Ok(())
            }
            Err(error) => Err(error),
        }
    }

    /// Refuses steps that were lost or gained while nothing was wrong with the stage as far as it could tell.
    pub(super) fn check_home_shift(&self, home_shift_mm: Option<f64>) -> Result<(), CaptureError> {
        let limit_mm = self.plan.limits.position_mm;
        let Some(shift_mm) = home_shift_mm.filter(|shift_mm| shift_mm.abs() > limit_mm) else {
            return Ok(());
        };
        let how = format!(
            "home was found {shift_mm:+.4} mm from where it had been (limits.position allows {limit_mm} mm): steps were lost or gained"
        );
        Err(CaptureError::NotClosed { how })
    }

    /// What was found is kept, also if it is more than is allowed.
    fn measure_closure(&mut self) -> Result<(), CaptureError> {
        if self.rig.pause.pressed() {
            return Err(CaptureError::Paused);
        }
        let first = self.first.take().map(|frame| GoodFrame { index: 0, frame });
        let comparison = first.map_or(Ok(None), |first| self.measure_shift(&first))?;
        self.stage_now()?.home()?;
        let home_shift_mm = self.stage_now()?.home_shift_mm();
        self.closure = Some(ClosureRecord { home_shift_mm, comparison: comparison.clone() });
        comparison.map_or(Ok(()), |found| self.check_shift(&found))?;
        self.check_home_shift(home_shift_mm)
    }
}

/// Errors that tell nothing of where the carriage is: the camera's, and those of a stage that is not heard.
fn is_silence(error: &CaptureError) -> bool {
    match error {
        CaptureError::Camera(_) => true,
        CaptureError::Stage(error) => is_unheard(error),
        _ => false,
    }
}
