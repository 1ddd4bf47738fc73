//! Comparing the rig with what it was: after homing, and at the end.

use super::CaptureError;
use super::scan::{GoodFrame, Scan};
use crate::sequence::{ClosureRecord, ComparisonRecord};
use crate::shift::{ShiftError, shift_between};

impl Scan<'_, '_> {
    /// Takes a good frame again and compares it with what it was. `None` if it shows too little to tell.
    pub(super) fn compare(&mut self, good: &GoodFrame) -> Result<Option<ComparisonRecord>, CaptureError> {
        let found = self.measure_shift(good)?;
        if let Some(found) = &found {
            let moved_px = found.x_px.hypot(found.y_px);
            let limit_px = self.plan.limits.shift_px;
            // What cannot be told apart from no shift is none.
            if moved_px > limit_px + 3.0 * found.sigma_px {
                let how =
                    format!("the picture has moved by {moved_px:.2} px (limits.shift allows {limit_px} px)");
                return Err(CaptureError::Moved { frame: good.index, how });
            }
        }
        Ok(found)
    }

    fn measure_shift(&mut self, good: &GoodFrame) -> Result<Option<ComparisonRecord>, CaptureError> {
        let position_mm = self.plan.positions_mm[good.index];
        self.stage_now()?.move_to(position_mm)?;
        let at_rest = self.camera().now().after(self.plan.settle);
        let (again, _) = self.look(at_rest)?;
        match shift_between(&good.frame, &again) {
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
    /// All frames are there by then, so a device that fails now costs the closure only.
    pub(super) fn close(&mut self) -> Result<Option<ClosureRecord>, CaptureError> {
        let progress = self.rig.progress;
        let measured = self.measure_closure();
        let closure = match measured {
            Ok(closure) => closure,
            Err(error @ CaptureError::Moved { .. }) => {
                return Err(CaptureError::NotClosed { how: error.to_string() });
            }
            Err(error) if error.is_wanted() => {
                progress.note("note: stopped after the last frame; what re-homing would show is not known");
                return Ok(None);
            }
            Err(error) => {
                progress.note(&format!(
                    "note: all frames are there, but what re-homing would show is not known: {error}"
                ));
                return Ok(None);
            }
        };
        let limits = &self.plan.limits;
        if let Some(shift_mm) = closure.home_shift_mm.filter(|shift_mm| shift_mm.abs() > limits.position_mm) {
            let how = format!(
                "home was found {shift_mm:+.4} mm from where it had been (limits.position allows {} mm): steps were lost or gained",
                limits.position_mm
            );
            return Err(CaptureError::NotClosed { how });
        }
        Ok(Some(closure))
    }

    fn measure_closure(&mut self) -> Result<ClosureRecord, CaptureError> {
        if self.rig.pause.pressed() {
            return Err(CaptureError::Paused);
        }
        let comparison = match self.first.take() {
            Some(frame) => self.compare(&GoodFrame { index: 0, frame })?,
            None => None,
        };
        self.stage_now()?.home()?;
        let home_shift_mm = self.stage_now()?.home_shift_mm();
        Ok(ClosureRecord { home_shift_mm, comparison })
    }
}
