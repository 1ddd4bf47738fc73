//! What a driver of a stage writes: orders and answers of one dialect.

use std::time::Duration;

use super::{StageError, StageIdentity, StageState, StopSwitch};

/// How long a motion may take beyond what its velocity and acceleration say.
const GRACE: Duration = Duration::from_secs(5);

/// A linear axis as its dialect speaks: it sends orders, waits for their end and reads what the device says.
///
/// Whether an answer is to be believed is decided by [`CheckedStage`](super::CheckedStage), once for all dialects: travel,
/// position tolerance, least duration, approach from one side, and what a fault leaves of the position.
///
/// All positions are in mm from home.
pub trait Axis: Send {
    /// What it is, for records and messages.
    fn identity(&self) -> StageIdentity;

    /// Positions go from 0 to this, in mm.
    fn travel_mm(&self) -> f64;

    /// Velocity, acceleration and length of a step.
    fn kinematics(&self) -> Kinematics;

    /// Whether the device knew its position when it was connected. Asks nothing of it.
    fn is_homed(&self) -> bool;

    /// Searches home and waits until the axis is at rest there.
    ///
    /// # Errors
    /// [`StageError`] if home was not found.
    fn home(&mut self) -> Result<Homed, StageError>;

    /// The position that is reported at rest; `None` if the device does not know it.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer, or does not come to rest; `during` says what for.
    fn position_at_rest_mm(&mut self, during: &str) -> Result<Option<f64>, StageError>;

    /// Moves, waits for the end, and returns the position that is then reported; `None` if the device does not know it.
    /// Minds the [`stop_switch`](Self::stop_switch) while it waits.
    ///
    /// # Errors
    /// [`StageError`] if the motion failed or was stopped.
    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError>;

    /// How it stands.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer.
    fn state(&mut self) -> Result<StageState, StageError>;

    /// Slows down and stops whatever motion there is, and returns when the axis is at rest.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer.
    fn stop(&mut self) -> Result<(), StageError>;

    /// Tells the device, if it can be told, that its position is not to be believed by whoever connects next.
    fn forget_position(&mut self) {}

    /// What another thread stops a motion with.
    fn stop_switch(&self) -> StopSwitch;

    /// Time on the clock of the line, since some moment of the past.
    fn now(&self) -> Duration;

    /// Whether the motor is energised at rest, so that the carriage stays where it is. `None` if the device cannot tell.
    fn holds_at_rest(&self) -> Option<bool> {
        None
    }

    /// What a person should know of the device, though it can be used.
    fn notes(&self) -> &[String] {
        &[]
    }
}

/// What homing found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homed {
    /// The position that is reported at home, in mm: near 0.
    pub position_mm: f64,
    /// Where home was found, in mm by the count kept until then; `None` if the position was not known before, or the device
    /// cannot tell.
    pub shift_mm: Option<f64>,
}

/// A move that is to be made.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Where the axis is, in mm from home.
    pub from_mm: f64,
    /// Where it is to go, in mm from home.
    pub target_mm: f64,
    /// When to give up waiting for its end.
    pub patience: Duration,
    /// What it is, for messages: `in the move to 12.500 mm`.
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
    /// How long a move takes, at best: a trapezoid of velocity, or a triangle if it is short.
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

    /// When to give up waiting for a move.
    pub fn patience(&self, distance_mm: f64) -> Duration {
        self.duration(distance_mm).saturating_mul(2).saturating_add(GRACE)
    }
}

impl<A: Axis + ?Sized> Axis for Box<A> {
    fn identity(&self) -> StageIdentity {
        (**self).identity()
    }

    fn travel_mm(&self) -> f64 {
        (**self).travel_mm()
    }

    fn kinematics(&self) -> Kinematics {
        (**self).kinematics()
    }

    fn is_homed(&self) -> bool {
        (**self).is_homed()
    }

    fn home(&mut self) -> Result<Homed, StageError> {
        (**self).home()
    }

    fn position_at_rest_mm(&mut self, during: &str) -> Result<Option<f64>, StageError> {
        (**self).position_at_rest_mm(during)
    }

    fn go_to(&mut self, motion: &Motion) -> Result<Option<f64>, StageError> {
        (**self).go_to(motion)
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        (**self).state()
    }

    fn stop(&mut self) -> Result<(), StageError> {
        (**self).stop()
    }

    fn forget_position(&mut self) {
        (**self).forget_position();
    }

    fn stop_switch(&self) -> StopSwitch {
        (**self).stop_switch()
    }

    fn now(&self) -> Duration {
        (**self).now()
    }

    fn holds_at_rest(&self) -> Option<bool> {
        (**self).holds_at_rest()
    }

    fn notes(&self) -> &[String] {
        (**self).notes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_those_of_a_trapezoid() {
        let kinematics = Kinematics { velocity_mm_s: 5.0, acceleration_mm_s2: 20.0, step_mm: 0.004 };
        // 1.25 mm are the two ramps of 0.25 s; every further mm takes 0.2 s.
        assert!((kinematics.duration(1.25).as_secs_f64() - 0.5).abs() < 1e-9);
        assert!((kinematics.duration(-2.25).as_secs_f64() - 0.7).abs() < 1e-9);
        // A quarter of the distance takes half of the time where there are ramps only.
        assert!((kinematics.duration(0.3125).as_secs_f64() - 0.25).abs() < 1e-9);
    }
}
