//! Approach from one side, for stages with backlash.

use std::time::Duration;

use super::{Stage, StageError, StageIdentity, StageState, StopSwitch, on_travel};

/// A stage that ends every move upwards: the slack of screw and nut is then always on the same side.
///
/// ```
/// use epirig_devices::stage::{OneSided, SimStage, SimStageConfig, Stage};
///
/// let slack = SimStageConfig { backlash_um: 50.0, ..SimStageConfig::ideal(100.0) };
/// let mut stage = OneSided::new(SimStage::new(slack), 0.5);
/// let position = stage.inner().watch();
/// stage.home()?;
/// stage.move_to(10.0)?;
/// stage.move_to(5.0)?; // goes to 4.5 mm first
/// assert!((position.get_mm() - 5.0).abs() < 1e-9);
/// # Ok::<(), epirig_devices::stage::StageError>(())
/// ```
#[derive(Debug)]
pub struct OneSided<S> {
    stage: S,
    approach_mm: f64,
}

impl<S: Stage> OneSided<S> {
    /// Comes to each position from `approach_mm` or more below it; 0 lets the stage go directly.
    pub fn new(stage: S, approach_mm: f64) -> Self {
        Self { stage, approach_mm }
    }

    /// The stage itself.
    pub fn inner(&self) -> &S {
        &self.stage
    }
}

impl<S: Stage> Stage for OneSided<S> {
    fn identity(&self) -> StageIdentity {
        self.stage.identity()
    }

    fn travel_mm(&self) -> f64 {
        self.stage.travel_mm()
    }

    fn home(&mut self) -> Result<(), StageError> {
        self.stage.home()
    }

    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError> {
        let approach_mm = self.approach_mm;
        if approach_mm > 0.0 {
            on_travel(position_mm, self.travel_mm())?;
            let below_mm = position_mm - approach_mm;
            if below_mm < 0.0 {
                return Err(StageError::NoApproach { position_mm, approach_mm });
            }
            if self.stage.position_mm()? > below_mm {
                self.stage.move_to(below_mm)?;
            }
        }
        self.stage.move_to(position_mm)
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        self.stage.state()
    }

    fn stop(&mut self) -> Result<(), StageError> {
        self.stage.stop()
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
