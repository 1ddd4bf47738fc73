//! Homing a GRBL stage.
//!
//! GRBL is silent while it homes, and answers queries at the end. So an answer at rest that comes too early
//! shows that the order was lost, and one that comes later shows the end, even if its `ok` was lost.

use std::time::Duration;

use super::GrblAxis;
use super::connect::{refused, set_feed};
use super::protocol::{BOOT_PATIENCE, POLL, STATUS_QUERY};
use super::response::{Response, State};
use super::settings::{AxisLetter, AxisSettings};
use super::texts::alarm_text;
use crate::stage::{Homed, StageError, Urgency};

const DURING: &str = "while homing";

/// So many answers at rest show a state, even if earlier ones come late.
const CONFIRMED: u32 = 5;

/// Alarms of homing that may be due to another axis: the switch stayed closed, or was not found.
const OF_ANY_AXIS: [u8; 2] = [8, 9];

impl GrblAxis {
    /// Homes, checks where it ends, and marks the controller.
    pub(super) fn find_home(&mut self) -> Result<Homed, StageError> {
        let before_mm = self.status()?.position_mm;
        let began = self.lines.now();
        self.search(&before_mm)?;
        let took_s = (self.lines.now() - began).as_secs_f64();
        let rest = self.at_rest(DURING)?;
        let machine_mm = rest.machine_mm[self.options.axis.index()];
        let steps = self.axis.steps(machine_mm);
        let is_home = [self.axis.home_steps, self.other.home_steps].contains(&steps);
        // An `ok` is not enough: one flipped bit turns `$H` into `$X`, which unlocks without homing.
        if !is_home || took_s < self.axis.least_homing_s {
            let home_mm = |axis: &AxisSettings| axis.home_steps as f64 / axis.steps_per_mm;
            let fault = format!(
                "it reports the end of homing after {took_s:.2} s at {machine_mm} mm, but by its settings home is at {} or {} mm after {:.2} s at least; home it again",
                home_mm(&self.axis),
                home_mm(&self.other),
                self.axis.least_homing_s
            );
            return Err(StageError::fault(DURING, fault));
        }
        if steps != self.axis.home_steps {
            std::mem::swap(&mut self.axis, &mut self.other);
        }
        set_feed(&mut self.lines, self.axis.mark)?;
        self.is_homed = true;
        Ok(Homed { position_mm: 0.0, shift_mm: None })
    }

    /// Sends `$H`, and waits for its end.
    fn search(&mut self, before_mm: &[f64]) -> Result<(), StageError> {
        let patience = Duration::try_from_secs_f64(2.0 * self.axis.homing_s)
            .unwrap_or(Duration::MAX)
            .saturating_add(BOOT_PATIENCE);
        self.lines.send_line("$H")?;
        let since = self.lines.now();
        // Successive answers at rest, and when the first of them came.
        let (mut at_rest, mut rest_since) = (0, since);
        while self.lines.now() - since < patience {
            if self.stop.pressed().is_some() {
                // It obeys no hold while it homes, and its position is unknown anyway.
                return Err(self.stop_motion(Urgency::AtOnce)?);
            }
            match self.lines.next(self.lines.now() + POLL)? {
                Some(Response::Ok) => return Ok(()),
                Some(Response::Error(code)) => return Err(refused(code)),
                Some(Response::Alarm(code)) => return Err(self.homing_alarm(code, before_mm)?),
                Some(Response::Banner { .. }) => return Err(self.restarted(DURING)),
                // Homing gives no such output, so the command was damaged on its way.
                Some(Response::Feedback { kind, text }) => {
                    let fault = format!("it received another command ([{kind}:{text}]); home it again");
                    return Err(StageError::fault(DURING, fault));
                }
                Some(Response::Status(status)) => {
                    let is_rest = matches!(status.state, State::Idle | State::Alarm);
                    if at_rest == 0 {
                        rest_since = self.lines.now();
                    }
                    at_rest = if is_rest { at_rest + 1 } else { 0 };
                    if at_rest >= CONFIRMED {
                        return self.ended(status.state, rest_since - since);
                    }
                    self.lines.send_byte(STATUS_QUERY)?;
                }
                Some(_) => {}
                None => self.lines.send_byte(STATUS_QUERY)?,
            }
        }
        self.stop_motion(Urgency::AtOnce)?;
        Err(StageError::too_slow(DURING, patience))
    }

    /// It answers, and did from `took` after the order on, so it does not home now. Was it done?
    fn ended(&self, state: State, took: Duration) -> Result<(), StageError> {
        let fault = match state {
            _ if took.as_secs_f64() < self.axis.least_homing_s => {
                "it did not begin: the order was lost on the line; home it again"
            }
            State::Idle => return Ok(()),
            _ => "it is locked again, without telling why; home it again",
        };
        Err(StageError::fault(DURING, fault))
    }

    /// GRBL does not tell which axis failed; the counts show which one it was moving.
    fn homing_alarm(&mut self, code: u8, before_mm: &[f64]) -> Result<StageError, StageError> {
        let error = self.alarm(code, DURING)?;
        if !OF_ANY_AXIS.contains(&code) {
            return Ok(error);
        }
        let after_mm = self.status()?.position_mm;
        let has_moved = |axis: AxisLetter| {
            before_mm.get(axis.index()).zip(after_mm.get(axis.index())).is_some_and(|(a, b)| a != b)
        };
        let ours = self.options.axis;
        let others: Vec<String> = [AxisLetter::X, AxisLetter::Y, AxisLetter::Z]
            .into_iter()
            .filter(|axis| *axis != ours && has_moved(*axis))
            .map(|axis| axis.letter().to_string())
            .collect();
        if others.is_empty() {
            return Ok(error);
        }
        let (others, letter) = (others.join(" and "), ours.letter());
        let cause = if has_moved(ours) {
            format!("axis {others} was homed together with {letter}, so either may be the cause")
        } else {
            format!("axis {letter} had not moved: axis {others} is homed before it")
        };
        let fault = format!(
            "{} (ALARM:{code}). {cause}. GRBL homes Z, then X and Y, as built by its authors: fit a switch \
             to each, or build it with HOMING_CYCLE_0 for axis {letter} alone",
            alarm_text(code)
        );
        Ok(StageError::fault(DURING, fault))
    }
}
