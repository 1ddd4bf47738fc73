//! What GRBL says of itself: states, positions at rest, restarts and alarms.

use std::time::Duration;

use super::GrblAxis;
use super::connect::{no_answer, reset};
use super::protocol::{BOOT_PATIENCE, EXCHANGES, STATUS_PATIENCE, STATUS_QUERY};
use super::response::{Response, State, Status};
use super::texts::alarm_text;
use crate::stage::{StageError, Urgency};

/// Two successive answers at rest that are the same.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rest {
    pub(super) state: State,
    /// Machine coordinates of all axes, in mm.
    pub(super) machine_mm: Vec<f64>,
}

impl GrblAxis {
    /// Asks for the status until there is an answer.
    pub(super) fn status(&mut self) -> Result<Status, StageError> {
        for _ in 0..EXCHANGES {
            if let Some(status) = self.ask_status("at rest", STATUS_PATIENCE)? {
                return Ok(status);
            }
        }
        Err(no_answer(&self.lines, "?", STATUS_PATIENCE * EXCHANGES))
    }

    /// Asks for the status once.
    pub(super) fn ask_status(
        &mut self,
        during: &str,
        patience: Duration,
    ) -> Result<Option<Status>, StageError> {
        self.lines.send_byte(STATUS_QUERY)?;
        let until = self.lines.now() + patience;
        while let Some(response) = self.lines.next(until)? {
            match response {
                Response::Status(status) => return Ok(Some(status)),
                Response::Alarm(code) => return Err(self.alarm(code, during)?),
                Response::Banner { .. } => return Err(self.restarted(during)),
                _ => {}
            }
        }
        Ok(None)
    }

    /// Waits until two successive answers show the same state at rest and the same coordinates: one alone may
    /// be damaged.
    pub(super) fn at_rest(&mut self, during: &str) -> Result<Rest, StageError> {
        let mut before = None;
        let until = self.lines.now() + BOOT_PATIENCE;
        while self.lines.now() < until {
            if let Some(urgency) = self.stop.pressed() {
                return Err(self.stop_motion(urgency)?);
            }
            let status = self.status()?;
            // Motion ends first. Work positions are of no use.
            let is_rest = !status.state.moving()
                && !status.is_work_position
                && self.options.axis.index() < status.position_mm.len();
            let now = is_rest.then_some(Rest { state: status.state, machine_mm: status.position_mm });
            match now {
                Some(rest) if before.as_ref() == Some(&rest) => return self.usable(rest, during),
                _ => before = now,
            }
        }
        self.stop_motion(Urgency::Soon)?;
        Err(StageError::too_slow(during, BOOT_PATIENCE))
    }

    /// Refuses states in which no command is obeyed.
    fn usable(&mut self, rest: Rest, during: &str) -> Result<Rest, StageError> {
        let fault = match rest.state {
            State::Idle => return Ok(rest),
            State::Hold { .. } => {
                let machine_mm = rest.machine_mm.get(self.options.axis.index());
                return Err(StageError::Held { position_mm: machine_mm.and_then(|mm| self.place_mm(*mm)) });
            }
            State::Alarm => "it is locked, as after a restart or an alarm; home it",
            State::Door { .. } => "its safety door is open; close it, then home it",
            State::Check => "it is in check mode, in which nothing moves; home it",
            State::Sleep => "it sleeps, and its motors have no current; home it",
            State::Run | State::Jog | State::Home => "it moves by itself; home it",
        };
        Err(StageError::fault(during, fault))
    }

    /// A machine coordinate in mm from home; `None` if it is not homed.
    pub(super) fn place_mm(&self, machine_mm: f64) -> Option<f64> {
        self.is_homed.then(|| self.axis.place_mm(self.axis.steps(machine_mm)))
    }

    /// The machine coordinate of the axis, in steps.
    pub(super) fn steps_of(&self, status: &Status) -> Option<i64> {
        let machine_mm = status.position_mm.get(self.options.axis.index())?;
        (!status.is_work_position).then(|| self.axis.steps(*machine_mm))
    }

    pub(super) fn restarted(&mut self, during: &str) -> StageError {
        self.is_homed = false;
        StageError::Restarted { during: during.to_owned() }
    }

    /// After an alarm GRBL needs a reset before it answers.
    pub(super) fn alarm(&mut self, code: u8, during: &str) -> Result<StageError, StageError> {
        self.is_homed = false;
        reset(&mut self.lines)?;
        Ok(StageError::fault(during, format!("{} (ALARM:{code})", alarm_text(code))))
    }
}
