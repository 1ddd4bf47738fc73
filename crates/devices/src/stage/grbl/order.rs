//! The order to move, in a form that no single damaged byte turns into a motion elsewhere.
//!
//! GRBL has no checksums: `X-60000` is as good as `X-6.0000`. So the target goes first, as the origin of the
//! work coordinates (`G92`), which moves nothing and is read back. Then a jog to `X.0` moves: whatever becomes
//! of these digits is within 0.8 mm, and another letter of an axis finds its origin where that axis stands. A
//! jog carries its modes and its feed, obeys soft limits without an alarm, and ends in a hold with its position.

use super::GrblAxis;
use super::connect::{no_answer, refused};
use super::protocol::{EXCHANGES, REPLY_PATIENCE, REPORT_ROUNDING_MM, STATUS_PATIENCE, TRIES};
use super::response::{Response, State};
use super::settings::MOST_AXES;
use crate::stage::StageError;

/// Letters of GRBL's axes, in the order of their coordinates.
const LETTERS: [char; MOST_AXES] = ['X', 'Y', 'Z', 'A', 'B', 'C'];

/// More than the velocity of any axis, in mm/min: GRBL limits it to that of the axis. A lost digit leaves it
/// high enough, and no bit of a 7 makes another axis of it, as one of a 9 makes a Y.
const FULL_FEED: u32 = 777_777;

/// Fraction of a step by which the echo of the target may be off, beyond its rounding.
const ECHO_WITHIN_STEPS: f64 = 0.1;

/// The answer to an order to move.
pub(super) enum Ordered {
    /// It may be moving.
    Accepted,
    /// It has verifiably not begun.
    Refused(StageError),
}

impl GrblAxis {
    /// Puts the origin of the work coordinates at `target_mm` of the axis, and for the other axes where they
    /// are. All are in mm; `machine_mm` are the coordinates at rest.
    ///
    /// In the mode G0 axis words alone would move. So the line holds a word of each group into which a damaged
    /// G92 may fall: G90 and G94, and the mark as feed rate. GRBL refuses a line with two words of a group.
    pub(super) fn place_origin(
        &mut self,
        target_mm: f64,
        machine_mm: &[f64],
        during: &str,
    ) -> Result<(), StageError> {
        let index = self.options.axis.index();
        // GRBL counts from where it was sent, which may be half a step beside where it is.
        let mut counted_mm = machine_mm[index];
        let (step_mm, mark) = (self.axis.kinematics.step_mm, self.axis.mark);
        let mut last = no_answer(&self.lines, "G92", REPLY_PATIENCE);
        for attempt in 0..EXCHANGES {
            if attempt > 0 {
                // It may be held, or locked.
                self.at_rest(during)?;
            }
            let words: String = LETTERS
                .iter()
                .zip(machine_mm)
                .enumerate()
                .map(|(of, (letter, _))| match of == index {
                    // Avoids minus zero.
                    true => format!("{letter}{:.4}", counted_mm - target_mm + 0.0),
                    false => format!("{letter}0"),
                })
                .collect();
            self.lines.send_line(&format!("G90G94G21G92{words}F{mark}"))?;
            match self.lines.answer(REPLY_PATIENCE)? {
                Some(Response::Ok) => {}
                Some(Response::Alarm(code)) => return Err(self.alarm(code, during)?),
                Some(Response::Banner { .. }) => return Err(self.restarted(during)),
                Some(Response::Error(code)) => last = refused(code),
                // Its end may be lost: an empty line completes it.
                Some(_) | None => self.lines.send_line("")?,
            }
            let Some(origin_mm) = self.origin(during)? else { continue };
            let off_mm = |of: usize, mm: f64| {
                origin_mm.get(of).map_or(f64::INFINITY, |origin_mm| (origin_mm - mm).abs())
            };
            let others_stand = (0..machine_mm.len().min(LETTERS.len())).filter(|of| *of != index).all(|of| {
                off_mm(of, machine_mm[of]) <= self.axis.half_steps_mm[of] + 2.0 * REPORT_ROUNDING_MM
            });
            if !others_stand {
                continue;
            }
            if off_mm(index, target_mm) <= ECHO_WITHIN_STEPS * step_mm + REPORT_ROUNDING_MM {
                return Ok(());
            }
            let counts_from_mm = origin_mm[index] + (counted_mm - target_mm);
            if (counts_from_mm - machine_mm[index]).abs() <= step_mm / 2.0 + 2.0 * REPORT_ROUNDING_MM {
                counted_mm = counts_from_mm;
            }
        }
        Err(last)
    }

    /// The origin of the work coordinates, which the next answers carry once it has changed.
    fn origin(&mut self, during: &str) -> Result<Option<Vec<f64>>, StageError> {
        for _ in 0..TRIES {
            if let Some(status) = self.ask_status(during, STATUS_PATIENCE)?
                && let Some(origin_mm) = status.work_offset_mm
            {
                return Ok(Some(origin_mm));
            }
        }
        Ok(None)
    }

    /// Sends the jog to the origin of the work coordinates. The axis comes first: elsewhere, `.0` would belong
    /// to the word before if its letter were lost, and GRBL 1.1h takes a jog without an axis as one of all axes
    /// to machine coordinate 0.
    pub(super) fn order(&mut self, from_steps: i64, during: &str) -> Result<Ordered, StageError> {
        let letter = self.options.axis.letter();
        self.lines.send_line(&format!("$J={letter}.0G90G21F{FULL_FEED}"))?;
        let refusal = match self.lines.answer(REPLY_PATIENCE)? {
            Some(Response::Ok) => return Ok(Ordered::Accepted),
            Some(Response::Alarm(code)) => return Err(self.alarm(code, during)?),
            Some(Response::Banner { .. }) => return Err(self.restarted(during)),
            Some(Response::Error(code)) => refused(code),
            Some(_) | None => {
                self.lines.send_line("")?;
                no_answer(&self.lines, "$J", REPLY_PATIENCE)
            }
        };
        let status = self.status()?;
        if status.state == State::Idle && self.steps_of(&status) == Some(from_steps) {
            return Ok(Ordered::Refused(refusal));
        }
        // It has begun after all.
        Ok(Ordered::Accepted)
    }
}
