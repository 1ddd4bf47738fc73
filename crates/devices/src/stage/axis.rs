//! The interface of a stage driver: commands and answers of one dialect.

use std::time::Duration;

use super::{PositionSettings, StageError, StageIdentity, StageState, StopSwitch};

/// Extra time for a motion beyond the time from velocity and acceleration.
const GRACE: Duration = Duration::from_secs(5);

/// A linear axis with its dialect: sends commands, waits for their end and reads the answers.
///
/// [`CheckedStage`](super::CheckedStage) checks the answers, in the same way for all dialects: travel,
/// position tolerance, least duration, unidirectional approach, and the position after a fault.
///
/// All positions are in mm from home.
pub trait Axis: Send {
    /// Identity of the axis, for records and messages.
    fn identity(&self) -> StageIdentity;

    /// Length of the travel, in mm; positions go from 0 to this.
    fn travel_mm(&self) -> f64;

    /// Velocity, acceleration and length of a step.
    fn kinematics(&self) -> Kinematics;

    /// Whether the device knew its position when it was connected. Does not ask the device.
    fn is_homed(&self) -> bool;

    /// Asks the device for its [`PositionSettings`], and uses the answers from now on. Homing follows.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer, or its settings prevent a measurement.
    fn position_settings(&mut self) -> Result<PositionSettings, StageError>;

    /// Homes the axis, and waits until it is at rest. Its settings have just been read.
    ///
    /// # Errors
    /// [`StageError`] if home was not found.
    fn home(&mut self) -> Result<Homed, StageError>;

    /// The reported position at rest; `None` if the device does not know it.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer, or does not come to rest; `during` names the operation.
    fn position_at_rest_mm(&mut self, during: &str) -> Result<Option<f64>, StageError>;

    /// Moves, waits for the end, and returns the reported position; `None` if the device does not know it.
    /// Obeys the [`stop_switch`](Self::stop_switch) while it waits.
    ///
    /// # Errors
    /// [`StageError`] if the motion failed or was stopped.
    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError>;

    /// Present state.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer.
    fn state(&mut self) -> Result<StageState, StageError>;

    /// Decelerates and stops any motion, and returns when the axis is at rest.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer.
    fn stop(&mut self) -> Result<(), StageError>;

    /// Marks the position as invalid in the device, if possible, for the next program that connects.
    fn forget_position(&mut self) {}

    /// The switch by which another thread stops a motion.
    fn stop_switch(&self) -> StopSwitch;

    /// Time on the clock of the line, from an arbitrary zero.
    fn now(&self) -> Duration;

    /// Whether the motor is energised at rest, which holds the carriage. `None` if the device does not report
    /// it.
    fn holds_at_rest(&self) -> Option<bool> {
        None
    }

    /// Notes on the device for the user.
    fn notes(&self) -> &[String] {
        &[]
    }
}

/// Result of homing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homed {
    /// Reported position at home, in mm: near 0.
    pub position_mm: f64,
    /// Position of home by the former count, in mm; `None` if the position was unknown before, or the device
    /// does not report it.
    pub shift_mm: Option<f64>,
}

/// A planned move.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Start, in mm from home.
    pub from_mm: f64,
    /// Target, in mm from home.
    pub target_mm: f64,
    /// Time-out.
    pub patience: Duration,
    /// Description for messages: `in the move to 12.500 mm`.
    pub during: String,
}

/// Velocity and acceleration of a stage, and the length of its steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinematics {
    /// Velocity of a long move, in mm/s, positive.
    pub velocity_mm_s: f64,
    /// Acceleration and deceleration, in mm/s2, positive.
    pub acceleration_mm_s2: f64,
    /// Length of a step, to which positions are rounded, in mm; 0 for none.
    pub step_mm: f64,
}

impl Kinematics {
    /// Least duration of a move: a trapezoid of velocity, or a triangle if it is short.
    pub fn duration(&self, distance_mm: f64) -> Duration {
        let (velocity, acceleration, distance) =
            (self.velocity_mm_s, self.acceleration_mm_s2, distance_mm.abs());
        let ramps_mm = velocity * velocity / acceleration;
        let seconds = if distance < ramps_mm {
            2.0 * (distance / acceleration).sqrt()
        } else {
            velocity / acceleration + distance / velocity
        };
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
    }

    /// Time-out of a move.
    pub fn patience(&self, distance_mm: f64) -> Duration {
        self.duration(distance_mm).saturating_mul(2).saturating_add(GRACE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_those_of_a_trapezoid() {
        let kinematics = Kinematics { velocity_mm_s: 5.0, acceleration_mm_s2: 20.0, step_mm: 0.004 };
        // The two ramps of 0.25 s are 1.25 mm; every further mm takes 0.2 s.
        assert!((kinematics.duration(1.25).as_secs_f64() - 0.5).abs() < 1e-9);
        assert!((kinematics.duration(-2.25).as_secs_f64() - 0.7).abs() < 1e-9);
        // With ramps only, a quarter of the distance takes half of the time.
        assert!((kinematics.duration(0.3125).as_secs_f64() - 0.25).abs() < 1e-9);
    }
}
