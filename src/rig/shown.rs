//! A real stage with a simulated camera, which sees the position that the stage reports.

use std::time::{Duration, Instant};

use epirig_devices::stage::{
    PositionSettings, Stage, StageError, StageIdentity, StagePosition, StageState, StopSwitch,
};

/// A stage whose reported position a simulated camera shows. So a rig can be rehearsed without its camera;
/// the frames do not show the true position of the carriage.
pub(super) struct Shown<S> {
    stage: S,
    watch: StagePosition,
    began: Instant,
    before: Duration,
}

impl<S: Stage> Shown<S> {
    /// Connects the stage to `watch`, whose time continues.
    pub(super) fn new(stage: S, watch: StagePosition) -> Self {
        let before = watch.elapsed();
        Self { stage, watch, began: Instant::now(), before }
    }

    /// Shows the position of the stage, if it is known.
    fn show<T>(&mut self, done: Result<T, StageError>) -> Result<T, StageError> {
        let done = done?;
        if let Some(position_mm) = self.stage.state()?.position_mm {
            self.watch.set(position_mm, self.before + self.began.elapsed());
        }
        Ok(done)
    }
}

impl<S: Stage> Stage for Shown<S> {
    fn identity(&self) -> StageIdentity {
        self.stage.identity()
    }

    fn travel_mm(&self) -> f64 {
        self.stage.travel_mm()
    }

    fn position_settings(&mut self) -> Result<PositionSettings, StageError> {
        self.stage.position_settings()
    }

    fn home(&mut self) -> Result<(), StageError> {
        let homed = self.stage.home();
        self.show(homed)
    }

    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError> {
        let moved = self.stage.move_to(position_mm);
        self.show(moved)
    }

    fn position_mm(&mut self) -> Result<f64, StageError> {
        self.stage.position_mm()
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        self.stage.state()
    }

    fn stop(&mut self) -> Result<(), StageError> {
        let stopped = self.stage.stop();
        self.show(stopped)
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

    fn notes(&self) -> &[String] {
        self.stage.notes()
    }
}
