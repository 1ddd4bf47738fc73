//! Moving and stopping a GRBL stage.

use std::time::Duration;

use super::GrblAxis;
use super::connect::{hold, no_answer, reset, set_feed};
use super::order::Ordered;
use super::protocol::{BOOT_PATIENCE, JOG_CANCEL, POLL, REPORT_ROUNDING_MM, STATUS_QUERY, TRIES};
use super::response::{Response, State, Status};
use crate::stage::{Motion, StageError, Urgency};

/// A jog ends within this time once it is cancelled: as for a hold.
const CANCEL_PATIENCE: Duration = Duration::from_secs(10);

/// Answers from before the order may come late: so many at the start do not show that it was lost.
const NOT_BEGUN: u32 = 5;

/// One answer may be damaged, two in a row at the same place are not.
const CONFIRMED: u32 = 2;

/// Steps by which a coordinate in motion may lie outside the way, beyond the rounding of the report.
const MARGIN_STEPS: i64 = 2;

const DAMAGED: &str = "the order was damaged on the line, or another program sends commands; check cable and \
                       earth, then home it";

/// How a motion ended.
enum End {
    /// At rest at this step.
    Rest(i64),
    /// The order was accepted and lost.
    NotBegun,
}

/// The way of a motion, in steps.
struct Way {
    from: i64,
    target: i64,
    margin: i64,
}

impl Way {
    fn holds(&self, steps: i64) -> bool {
        let (low, high) = (self.from.min(self.target), self.from.max(self.target));
        (low - self.margin..=high + self.margin).contains(&steps)
    }
}

/// What the answers in motion have shown so far.
#[derive(Default)]
struct Seen {
    rest: Option<i64>,
    at_rest: u32,
    outside: u32,
    unusual: u32,
}

impl GrblAxis {
    /// Moves, and returns where the axis came to rest, in mm from home.
    pub(super) fn run(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        let Motion { target_mm, patience, during, .. } = motion;
        if !self.is_homed {
            return Err(StageError::NotHomed);
        }
        let rest = self.at_rest(during)?;
        let index = self.options.axis.index();
        let from = self.axis.steps(rest.machine_mm[index]);
        let target = self.axis.target_steps(*target_mm);
        let margin = MARGIN_STEPS + (REPORT_ROUNDING_MM * self.axis.steps_per_mm).ceil() as i64;
        let way = Way { from, target, margin };
        let ordered_mm = self.axis.ordered_mm(target);
        let mut last = None;
        for _ in 0..TRIES {
            self.place_origin(ordered_mm, &rest.machine_mm, during)?;
            match self.order(from, during)? {
                Ordered::Refused(refusal) => last = Some(refusal),
                Ordered::Accepted => match self.watch(&way, during, *patience)? {
                    End::Rest(steps) => return Ok(Some(self.axis.place_mm(steps))),
                    End::NotBegun => last = None,
                },
            }
        }
        last.map_or_else(|| Ok(Some(self.axis.place_mm(from))), Err)
    }

    /// Waits for the end of a motion, and stops it if it leaves its way.
    fn watch(&mut self, way: &Way, during: &str, patience: Duration) -> Result<End, StageError> {
        let since = self.lines.now();
        let (mut seen, mut heard) = (Seen::default(), since);
        while self.lines.now() - since < patience {
            if let Some(urgency) = self.stop.pressed() {
                return Err(self.stop_motion(urgency)?);
            }
            let asked = self.lines.now();
            let Some(status) = self.ask_status(during, POLL)? else {
                // Nobody watches a motion that reports nothing.
                if self.lines.now() - heard > BOOT_PATIENCE {
                    let silent = no_answer(&self.lines, "?", BOOT_PATIENCE);
                    self.stop_motion(Urgency::Soon)?;
                    return Err(silent);
                }
                continue;
            };
            heard = self.lines.now();
            if let Some(end) = self.weigh(&status, &mut seen, way, during)? {
                return Ok(end);
            }
            if status.state.moving() {
                self.pause(asked + POLL, during)?;
            }
        }
        self.stop_motion(Urgency::Soon)?;
        Err(StageError::too_slow(during, patience))
    }

    /// Waits until `until`, and hears an alarm or a restart meanwhile.
    fn pause(&mut self, until: Duration, during: &str) -> Result<(), StageError> {
        while let Some(response) = self.lines.next(until)? {
            match response {
                Response::Alarm(code) => return Err(self.alarm(code, during)?),
                Response::Banner { .. } => return Err(self.restarted(during)),
                _ => {}
            }
        }
        Ok(())
    }

    fn weigh(
        &mut self,
        status: &Status,
        seen: &mut Seen,
        way: &Way,
        during: &str,
    ) -> Result<Option<End>, StageError> {
        let Some(steps) = self.steps_of(status) else { return Ok(None) };
        if status.state == State::Idle {
            seen.at_rest = if seen.rest == Some(steps) { seen.at_rest + 1 } else { 1 };
            seen.rest = Some(steps);
            seen.unusual = 0;
            let enough = if steps == way.from && steps != way.target { NOT_BEGUN } else { CONFIRMED };
            if seen.at_rest < enough {
                return Ok(None);
            }
            let (low, high) = (way.from.min(way.target), way.from.max(way.target));
            return match steps {
                _ if enough == NOT_BEGUN => Ok(Some(End::NotBegun)),
                // A feed hold ends a jog, and nothing tells who pressed it.
                _ if low < steps && steps < high => Err(StageError::Held {
                    position_mm: Some(self.axis.place_mm(steps)).filter(|_| self.is_homed),
                }),
                _ => Ok(Some(End::Rest(steps))),
            };
        }
        (seen.rest, seen.at_rest) = (None, 0);
        if status.state.moving() && status.state != State::Home {
            seen.unusual = 0;
            seen.outside = if way.holds(steps) { 0 } else { seen.outside + 1 };
            if seen.outside < CONFIRMED {
                return Ok(None);
            }
            self.stop_motion(Urgency::Soon)?;
            self.is_homed = false;
            let [at_mm, from_mm, target_mm] =
                [steps, way.from, way.target].map(|steps| self.axis.place_mm(steps));
            let fault = format!(
                "it was stopped at {at_mm:.3} mm, outside its way from {from_mm:.3} to {target_mm:.3} mm: {DAMAGED}"
            );
            return Err(StageError::fault(during, fault));
        }
        seen.unusual += 1;
        if seen.unusual < CONFIRMED {
            return Ok(None);
        }
        if status.state == State::Home {
            // `$J` may have become `$H`.
            self.stop_motion(Urgency::AtOnce)?;
            return Err(StageError::fault(during, format!("it began to home: {DAMAGED}")));
        }
        // Locked, held, asleep: this says what to do.
        self.at_rest(during)?;
        Ok(None)
    }

    /// Stops a motion safely: cancels a jog, or holds another motion and resets, which keeps the position. Or
    /// resets at once, which does not.
    pub(super) fn stop_motion(&mut self, urgency: Urgency) -> Result<StageError, StageError> {
        let was_homed = std::mem::take(&mut self.is_homed);
        let stop = self.stop.clone();
        let at_once = || stop.pressed() == Some(Urgency::AtOnce);
        if urgency == Urgency::Soon {
            if self.cancel_jog(at_once)? {
                self.is_homed = was_homed;
                let position_mm = self.position_at_rest()?;
                return Ok(StageError::Stopped { position_mm });
            }
            let held = hold(&mut self.lines, at_once)?;
            self.stop.sent(Urgency::Soon);
            reset(&mut self.lines)?;
            let status = self.status()?;
            if held && was_homed && status.state == State::Idle {
                set_feed(&mut self.lines, self.axis.mark)?;
                self.is_homed = true;
            }
        } else {
            reset(&mut self.lines)?;
            self.stop.sent(Urgency::AtOnce);
        }
        let position_mm = if self.is_homed { self.position_at_rest()? } else { None };
        Ok(StageError::Stopped { position_mm })
    }

    /// The position as two answers report it, whatever the stop switch says.
    fn position_at_rest(&mut self) -> Result<Option<f64>, StageError> {
        let mut before = None;
        for _ in 0..2 * TRIES {
            let status = self.status()?;
            let steps = self.steps_of(&status);
            if steps.is_some() && steps == before {
                return Ok(steps.map(|steps| self.axis.place_mm(steps)).filter(|_| self.is_homed));
            }
            before = steps;
        }
        Ok(None)
    }

    /// Cancels a jog, and waits until it has ended; `false` if something else than a jog moves, or for a
    /// stop at once.
    fn cancel_jog(&mut self, at_once: impl Fn() -> bool) -> Result<bool, StageError> {
        let (mut idle, until) = (0, self.lines.now() + CANCEL_PATIENCE);
        while self.lines.now() < until && !at_once() {
            // Repeated until it works; without a jog it does nothing.
            self.lines.send_byte(JOG_CANCEL)?;
            self.stop.sent(Urgency::Soon);
            self.lines.send_byte(STATUS_QUERY)?;
            let status_until = self.lines.now() + POLL;
            while let Some(response) = self.lines.next(status_until)? {
                let Response::Status(status) = response else { continue };
                match status.state {
                    State::Idle => idle += 1,
                    State::Jog => idle = 0,
                    _ => return Ok(false),
                }
                if idle >= CONFIRMED {
                    return Ok(true);
                }
                break;
            }
        }
        Ok(false)
    }
}
