//! Where the carriage of a simulated stage truly is.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// A view on where the carriage of a simulated stage truly is, and on the stage's time.
#[derive(Debug, Clone, Default)]
pub struct StagePosition(Arc<Mutex<(f64, Duration)>>);

impl StagePosition {
    /// Where the carriage is, in mm from home.
    pub fn get_mm(&self) -> f64 {
        self.get().0
    }

    /// Simulated time since the stage was made.
    pub fn elapsed(&self) -> Duration {
        self.get().1
    }

    /// Says where the carriage is, `elapsed` after the stage was made: for stages that are simulated elsewhere.
    pub fn set(&self, position_mm: f64, elapsed: Duration) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = (position_mm, elapsed);
    }

    fn get(&self) -> (f64, Duration) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
