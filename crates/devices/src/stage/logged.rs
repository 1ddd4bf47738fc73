//! A stage whose motions are told of as events.

use std::time::{Duration, Instant};

use tracing::{debug, debug_span, info, warn};

use super::{Stage, StageError, StageIdentity, StageState, StopSwitch};

/// Any stage, with events of `tracing` for its connection, homings, moves and their failures.
#[derive(Debug)]
pub struct LoggedStage<S> {
    stage: S,
    device: String,
}

impl<S: Stage> LoggedStage<S> {
    /// A stage that has just been connected.
    pub fn new(stage: S) -> Self {
        let device = stage.identity().to_string();
        info!(device, travel_mm = stage.travel_mm(), "stage connected");
        Self { stage, device }
    }
}

impl<S: Stage> Stage for LoggedStage<S> {
    fn identity(&self) -> StageIdentity {
        self.stage.identity()
    }

    fn travel_mm(&self) -> f64 {
        self.stage.travel_mm()
    }

    fn home(&mut self) -> Result<(), StageError> {
        let begun = Instant::now();
        let _span = debug_span!("home").entered();
        let homed = self.stage.home();
        let (device, seconds) = (&self.device, begun.elapsed().as_secs_f64());
        match &homed {
            Ok(()) => info!(device, seconds, home_shift_mm = self.stage.home_shift_mm(), "homed"),
            Err(reason) => warn!(device, seconds, %reason, "homing failed"),
        }
        homed
    }

    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError> {
        let begun = Instant::now();
        let _span = debug_span!("move").entered();
        let moved = self.stage.move_to(position_mm);
        let (device, seconds) = (&self.device, begun.elapsed().as_secs_f64());
        match &moved {
            Ok(()) => debug!(device, position_mm, seconds, "moved"),
            Err(reason) => warn!(device, position_mm, seconds, %reason, "move failed"),
        }
        moved
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        let state = self.stage.state();
        if let Err(reason) = &state {
            warn!(device = self.device, %reason, "the stage does not tell its state");
        }
        state
    }

    fn stop(&mut self) -> Result<(), StageError> {
        let stopped = self.stage.stop();
        match &stopped {
            Ok(()) => info!(device = self.device, "stopped"),
            Err(reason) => warn!(device = self.device, %reason, "the stage could not be stopped"),
        }
        stopped
    }

    fn stop_switch(&self) -> StopSwitch {
        self.stage.stop_switch()
    }

    fn home_shift_mm(&self) -> Option<f64> {
        self.stage.home_shift_mm()
    }

    fn expected_duration(&self, distance_mm: f64) -> Option<Duration> {
        self.stage.expected_duration(distance_mm)
    }

    fn holds_at_rest(&self) -> Option<bool> {
        self.stage.holds_at_rest()
    }
}
