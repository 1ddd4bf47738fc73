//! The motorised linear stage.
//!
//! [`Stage`] is the interface for the rest of the program. [`CheckedStage`] implements it: it wraps an
//! [`Axis`], which speaks the dialect of a device, with checks that are the same for all. The
//! [`drivers`](drivers()) are a table of [`StageDriver`]s: epirig's own firmware ([`native`]), [`grbl`],
//! [`zaber`], and [`sim`], which exists in memory only. The devices of [`simulator`] speak the same dialects
//! from the other side, with scripted faults.

mod axis;
mod checked;
mod consequence;
pub mod decode;
mod driver;
mod drivers;
mod error;
pub mod grbl;
pub mod keys;
mod limits;
pub mod native;
mod recognise;
pub mod sim;
pub mod simulator;
mod source;
mod stop;
mod watch;
pub mod zaber;

use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

pub use axis::{Axis, Homed, Kinematics, Motion};
pub use checked::CheckedStage;
pub use consequence::{Consequence, PositionAfter, Remedy};
pub use driver::{Connection, Console, Distrust, Greeting, StageDriver, WhenMoving};
pub use drivers::{Driver, add_drivers, driver_keys, drivers};
pub use error::StageError;
pub use grbl::GrblStage;
pub use native::NativeStage;
pub use recognise::connect;
pub use sim::{SimStage, SimStageConfig};
pub use source::StageSource;
pub use stop::{StopSwitch, Urgency};
pub use watch::StagePosition;
pub use zaber::ZaberStage;

/// Identity of a stage.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageIdentity {
    /// The name of its driver.
    pub driver: &'static str,
    /// What it reports of itself: model, version, build.
    pub description: String,
    /// The port, if there is one.
    pub port: Option<String>,
}

impl fmt::Display for StageIdentity {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.port {
            Some(port) => write!(to, "{} at {port}", self.description),
            None => write!(to, "{}", self.description),
        }
    }
}

/// Settings in a device that decide at which place a position is, by their names in its dialect: steps per
/// mm, direction and pull-off of homing, ... They outlast a power cut, and other programs can change them.
/// Empty: the device has none.
pub type PositionSettings = BTreeMap<String, f64>;

/// State of a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageState {
    /// Position, in mm from home; `None` if unknown.
    pub position_mm: Option<f64>,
    /// Whether it is moving.
    pub moving: bool,
    /// Whether a limit switch is closed.
    pub at_limit: bool,
}

/// A linear stage that moves to absolute positions, in mm from home.
///
/// A stage has a single user: `&mut` excludes a second thread, the port's lock a second process. Another
/// thread stops a motion through the [`StopSwitch`], which the waiting thread obeys.
pub trait Stage: Send {
    /// Identity, for records and messages.
    fn identity(&self) -> StageIdentity;

    /// Length of the travel, in mm; positions go from 0 to this.
    fn travel_mm(&self) -> f64;

    /// The settings that the device has now. After it the stage must be homed, because what has changed a
    /// setting may have moved the carriage.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer, or its settings prevent a measurement.
    fn position_settings(&mut self) -> Result<PositionSettings, StageError>;

    /// Homes the stage with the settings that it has now, and returns when it is at rest.
    ///
    /// # Errors
    /// [`StageError`] if homing fails; the position is unknown then.
    fn home(&mut self) -> Result<(), StageError>;

    /// Moves to `position_mm`, and returns when the stage is at rest and reports that position.
    ///
    /// # Errors
    /// [`StageError`] if the stage is not homed, the position is outside the travel, the motion failed, or
    /// the reported position is not the commanded one.
    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError>;

    /// The reported position, in mm from home.
    ///
    /// # Errors
    /// [`StageError`] if it is not homed or does not answer.
    fn position_mm(&mut self) -> Result<f64, StageError> {
        self.state()?.position_mm.ok_or(StageError::NotHomed)
    }

    /// Present state.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer.
    fn state(&mut self) -> Result<StageState, StageError>;

    /// Decelerates and stops any motion, and returns when the stage is at rest.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer.
    fn stop(&mut self) -> Result<(), StageError>;

    /// The switch by which another thread stops a motion.
    fn stop_switch(&self) -> StopSwitch;

    /// Position of home in the latest homing by the former count, in mm: the steps lost or gained since the
    /// homing before. `None` if the position was unknown before, or the stage does not report it.
    fn home_shift_mm(&self) -> Option<f64> {
        None
    }

    /// Duration of a move over `distance_mm` from velocity and acceleration; `None` if they are unknown.
    fn expected_duration(&self, _distance_mm: f64) -> Option<Duration> {
        None
    }

    /// Whether the motor is energised at rest, which holds the carriage. `None` if the stage does not report
    /// it.
    fn holds_at_rest(&self) -> Option<bool> {
        None
    }

    /// Notes on the stage for the user.
    fn notes(&self) -> &[String] {
        &[]
    }
}
