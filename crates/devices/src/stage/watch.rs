//! The true position of a simulated carriage.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A shared view of the true position of a simulated carriage, and of the stage's time. A stage in memory that is
/// connected again finds itself there as it was left.
#[derive(Debug, Clone, Default)]
pub struct StagePosition(Arc<Mutex<Carriage>>);

#[derive(Debug, Clone, Copy, Default)]
struct Carriage {
    position_mm: f64,
    elapsed: Duration,
    target_mm: Option<f64>,
    to_lose_mm: f64,
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

    /// Whether the stage was last sent to this position, in mm from home.
    pub fn is_sent_to(&self, position_mm: f64) -> bool {
        /// Far below a step of any stage.
        const SAME_MM: f64 = 1e-6;
        self.held().target_mm.is_some_and(|target_mm| (target_mm - position_mm).abs() < SAME_MM)
    }

    /// Tells where the stage is sent.
    pub fn set_target(&self, position_mm: f64) {
        self.held().target_mm = Some(position_mm);
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
