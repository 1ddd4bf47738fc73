//! Moving and stopping a GRBL stage.

use std::time::Duration;

use super::GrblAxis;
use super::connect::{hold, no_answer, refused, reset};
use super::lines::Heard;
use super::protocol::{BOOT_PATIENCE, HOMED_MARK, MILLIMETRES, POLL, REPLY_PATIENCE, STATUS_QUERY, TRIES};
use super::response::{Response, State};
use super::texts::error_text;
use crate::stage::{Motion, StageError, Urgency};

/// The error for a refusal while the axis may be moving, which makes the position uncertain.
fn refused_in_motion(code: u8, during: &str) -> StageError {
    StageError::Fault { during: during.to_owned(), fault: format!("{} (error:{code})", error_text(code)) }
}

impl GrblAxis {
    /// The machine position, once two successive answers show that the axis is at rest.
    pub(super) fn machine_mm_at_rest(&mut self, during: &str, patience: Duration) -> Result<f64, StageError> {
        let mut before = None;
        let until = self.lines.now() + patience.max(BOOT_PATIENCE);
        while self.lines.now() < until {
            if let Some(urgency) = self.stop.pressed() {
                return Err(self.stop_motion(urgency)?);
            }
            let status = self.status()?;
            let now = if status.state == State::Idle { self.machine_mm(&status) } else { None };
            match now {
                Some(machine_mm) if before == Some(machine_mm) => return Ok(machine_mm),
                _ => before = now,
            }
        }
        self.stop_motion(Urgency::Soon)?;
        Err(StageError::TooSlow { during: during.to_owned(), patience_s: patience.as_secs_f64() })
    }

    /// Sends a line whose `ok` comes at the end of all motion, and waits for it.
    pub(super) fn barrier(
        &mut self,
        line: &str,
        during: &str,
        patience: Duration,
        target_mm: Option<f64>,
    ) -> Result<(), StageError> {
        self.lines.send_line(line)?;
        let since = self.lines.now();
        let mut seen_there = 0;
        while self.lines.now() - since < patience {
            if let Some(urgency) = self.stop.pressed() {
                return Err(self.stop_motion(urgency)?);
            }
            match self.lines.next(POLL)? {
                Heard::Line(Response::Ok) => return Ok(()),
                Heard::Line(Response::Error(code)) => match target_mm {
                    Some(_) => return Err(refused_in_motion(code, during)),
                    None => return Err(refused(code)),
                },
                Heard::Line(Response::Alarm(code)) => return Err(self.alarm(code, during)?),
                Heard::Line(Response::Banner { .. }) => return Err(self.restarted(during)),
                Heard::Line(Response::Status(status)) => {
                    let status = self.note_offset(status);
                    // Its `ok` may be lost: half a second at rest at the target counts as the end.
                    let there = target_mm.zip(self.machine_mm(&status)).is_some_and(|(target_mm, at_mm)| {
                        status.state == State::Idle
                            && (target_mm - at_mm).abs() < self.axis.kinematics.step_mm
                    });
                    seen_there = if there { seen_there + 1 } else { 0 };
                    if seen_there >= 5 {
                        return Ok(());
                    }
                }
                // Homing gives no such output, so the command was damaged on its way.
                Heard::Line(Response::Feedback { kind, text }) if target_mm.is_none() => {
                    return Err(StageError::Fault {
                        during: during.to_owned(),
                        fault: format!("it received another command ([{kind}:{text}]); home it again"),
                    });
                }
                Heard::Line(_) => {}
                // During homing GRBL does not answer; its answer comes at the end and is skipped.
                Heard::Nothing if target_mm.is_some() => self.lines.send_byte(STATUS_QUERY)?,
                Heard::Nothing => {}
            }
        }
        self.stop_motion(Urgency::Soon)?;
        Err(StageError::TooSlow { during: during.to_owned(), patience_s: patience.as_secs_f64() })
    }

    /// Stops safely: hold, wait for rest, and reset, which keeps the position. Or resets at once, which does
    /// not.
    pub(super) fn stop_motion(&mut self, urgency: Urgency) -> Result<StageError, StageError> {
        let home_mm = self.home_mm.take();
        let stop = self.stop.clone();
        let at_once = || stop.pressed() == Some(Urgency::AtOnce);
        let held = urgency == Urgency::Soon && hold(&mut self.lines, at_once)?;
        reset(&mut self.lines)?;
        let status = self.status()?;
        if held && home_mm.is_some() && status.state == State::Idle {
            self.home_mm = home_mm;
            self.mark(HOMED_MARK)?;
        }
        Ok(StageError::Stopped { position_mm: self.position_of(&status) })
    }

    /// Sends an absolute move. It is repeated after a refusal or a lost `ok` if the axis has verifiably not
    /// moved; relative moves are never repeated.
    fn begin_move(&mut self, machine_mm: f64, from_mm: f64, during: &str) -> Result<(), StageError> {
        let letter = self.options.axis.letter();
        let line = format!("{MILLIMETRES} G90 G0 {letter}{:.4}", machine_mm - self.work_offset_mm);
        let mut last = no_answer(&self.lines, &line, REPLY_PATIENCE);
        for _ in 0..TRIES {
            self.lines.send_line(&line)?;
            match self.lines.answer(REPLY_PATIENCE)? {
                Heard::Line(Response::Ok) => return Ok(()),
                Heard::Line(Response::Alarm(code)) => return Err(self.alarm(code, during)?),
                Heard::Line(Response::Banner { .. }) => return Err(self.restarted(during)),
                Heard::Line(Response::Error(code)) => last = refused(code),
                Heard::Line(_) | Heard::Nothing => {}
            }
            let status = self.status()?;
            if status.state != State::Idle || self.position_of(&status) != Some(from_mm) {
                // It has begun after all.
                return Ok(());
            }
        }
        Err(last)
    }

    pub(super) fn run(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        let Motion { from_mm, target_mm, patience, during } = motion;
        let Some(home_mm) = self.home_mm else { return Err(StageError::NotHomed) };
        let machine_mm = home_mm + self.axis.outwards * target_mm;
        self.begin_move(machine_mm, *from_mm, during)?;
        self.barrier("G4 P0", during, *patience, Some(machine_mm))?;
        let machine_mm = self.machine_mm_at_rest(during, *patience)?;
        Ok(self.place_mm(machine_mm))
    }
}
