//! The true position of a simulated carriage.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A shared view of the true position of a simulated carriage, and of the stage's time. A stage in memory that is
/// connected again finds itself there as it was left.
#[derive(Debug, Clone, Default)]
pub struct StagePosition(Arc<Mutex<Carriage>>);

#[derive(Debug, Clone, Default)]
struct Carriage {
    position_mm: f64,
    elapsed: Duration,
    to_lose_mm: f64,
    due: Vec<usize>,
    left: Option<Screw>,
}

/// Motor, nut and slip of a stage in memory, in mm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Screw {
    /// Position of the motor, which the stage reports.
    pub(super) motor_mm: f64,
    /// Position of the nut without drift and noise.
    pub(super) nut_mm: f64,
    /// Total slip since homing.
    pub(super) slipped_mm: f64,
}

impl StagePosition {
    /// Position of the carriage, in mm from home.
    pub fn get_mm(&self) -> f64 {
        self.held().position_mm
    }

    /// Simulated time since the stage was made.
    pub fn elapsed(&self) -> Duration {
        self.held().elapsed
    }

    /// Sets the position of the carriage, `elapsed` after the stage was made: for stages simulated elsewhere.
    pub fn set(&self, position_mm: f64, elapsed: Duration) {
        let mut carriage = self.held();
        (carriage.position_mm, carriage.elapsed) = (position_mm, elapsed);
    }

    /// Tells who watches that the planned event with this number is due.
    pub fn set_due(&self, event: usize) {
        self.held().due.push(event);
    }

    /// The events that have become due since the last call.
    pub fn take_due(&self) -> Vec<usize> {
        std::mem::take(&mut self.held().due)
    }

    /// Lets the carriage of a stage in memory stay behind by a distance in its next move, unnoticed by the stage.
    pub fn lose_steps(&self, distance_mm: f64) {
        self.held().to_lose_mm += distance_mm;
    }

    /// The distance that is lost in this move.
    pub(super) fn take_lost_steps(&self) -> f64 {
        std::mem::take(&mut self.held().to_lose_mm)
    }

    /// Keeps how a stage in memory was left; `None` if it does not know its position.
    pub(super) fn leave(&self, screw: Option<Screw>) {
        self.held().left = screw;
    }

    /// How a stage in memory was left.
    pub(super) fn left(&self) -> Option<Screw> {
        self.held().left
    }

    fn held(&self) -> MutexGuard<'_, Carriage> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
