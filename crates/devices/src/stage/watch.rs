//! The true position of a simulated carriage.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// A shared view of the true position of a simulated carriage, and of the stage's time.
#[derive(Debug, Clone, Default)]
pub struct StagePosition(Arc<Mutex<(f64, Duration)>>);

impl StagePosition {
    /// Position of the carriage, in mm from home.
    pub fn get_mm(&self) -> f64 {
        self.get().0
    }

    /// Simulated time since the stage was made.
    pub fn elapsed(&self) -> Duration {
        self.get().1
    }

    /// Sets the position of the carriage, `elapsed` after the stage was made: for stages simulated elsewhere.
    pub fn set(&self, position_mm: f64, elapsed: Duration) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = (position_mm, elapsed);
    }

    fn get(&self) -> (f64, Duration) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
