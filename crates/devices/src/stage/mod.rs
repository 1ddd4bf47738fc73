//! The motorised linear stage.
//!
//! [`Stage`] is what the rest of the program knows. Behind it: [`NativeStage`] (epirig's own firmware), [`GrblStage`],
//! [`ZaberStage`], and [`SimStage`], which exists in memory only. The drivers speak over a [`Link`](crate::link::Link); the
//! devices of [`simulator`] speak the same dialects from the other side, with faults by script.

pub mod decode;
mod error;
pub mod grbl;
mod logged;
pub mod native;
mod one_sided;
mod sim;
pub mod simulator;
mod source;
mod stop;
mod tolerance;
pub mod zaber;

use std::fmt;
use std::time::Duration;

pub use error::StageError;
pub use grbl::GrblStage;
pub use logged::LoggedStage;
pub use native::NativeStage;
pub use one_sided::OneSided;
pub use sim::{SimStage, SimStageConfig, StagePosition};
pub use source::StageSource;
pub use stop::{StopSwitch, Urgency};
pub use tolerance::MotionLimits;
pub use zaber::ZaberStage;

/// What a stage is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StageIdentity {
    /// The dialect it speaks.
    pub dialect: Dialect,
    /// What it says of itself: model, version, build.
    pub description: String,
    /// Where it is connected, if it is.
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

/// The languages that stages speak.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    /// epirig's own, see `firmware-protocol/PROTOCOL.md`.
    Native,
    /// GRBL 1.1.
    Grbl,
    /// Zaber ASCII.
    Zaber,
    /// None: a stage in memory.
    Simulated,
}

impl Dialect {
    /// Its name in commands and records.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Grbl => "grbl",
            Self::Zaber => "zaber",
            Self::Simulated => "simulated",
        }
    }
}

/// How a stage stands at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageState {
    /// In mm from home; `None` if the stage does not know.
    pub position_mm: Option<f64>,
    /// Whether it moves.
    pub moving: bool,
    /// Whether a limit switch is closed.
    pub at_limit: bool,
}

/// A linear stage that moves to absolute positions, in mm from home.
///
/// Who has the stage has it alone: `&mut` keeps a second thread out, the port's lock a second process. Another thread
/// stops a motion through the [`StopSwitch`], which the thread that waits for the motion minds.
pub trait Stage: Send {
    /// What it is, for records and messages.
    fn identity(&self) -> StageIdentity;

    /// Positions go from 0 to this, in mm.
    fn travel_mm(&self) -> f64;

    /// Finds the home position and returns when the stage is at rest there.
    ///
    /// # Errors
    /// [`StageError`] if home cannot be found; the position is unknown then.
    fn home(&mut self) -> Result<(), StageError>;

    /// Moves to `position_mm` and returns when the stage is at rest and says that it is there.
    ///
    /// # Errors
    /// [`StageError`] if the stage is not homed, the position lies outside the travel, the motion failed, or the stage
    /// reports another position than it was sent to.
    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError>;

    /// Where the stage reports to be, in mm from home.
    ///
    /// # Errors
    /// [`StageError`] if it is not homed or does not answer.
    fn position_mm(&mut self) -> Result<f64, StageError> {
        self.state()?.position_mm.ok_or(StageError::NotHomed)
    }

    /// How it stands.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer.
    fn state(&mut self) -> Result<StageState, StageError>;

    /// Slows down and stops whatever motion there is, and returns when the stage is at rest.
    ///
    /// # Errors
    /// [`StageError`] if it does not answer.
    fn stop(&mut self) -> Result<(), StageError>;

    /// What another thread stops a motion with.
    fn stop_switch(&self) -> StopSwitch;

    /// Where the latest homing found home, in mm by the count kept until then: what was lost or gained since the homing
    /// before. `None` if the position was not known before, or the stage cannot tell.
    fn home_shift_mm(&self) -> Option<f64> {
        None
    }

    /// How long a move over `distance_mm` takes by velocity and acceleration; `None` if the stage does not tell them.
    fn expected_duration(&self, _distance_mm: f64) -> Option<Duration> {
        None
    }

    /// Whether the motor is energised at rest, so that the carriage stays where it is. `None` if the stage cannot tell.
    fn holds_at_rest(&self) -> Option<bool> {
        None
    }
}

impl<S: Stage + ?Sized> Stage for Box<S> {
    fn identity(&self) -> StageIdentity {
        (**self).identity()
    }

    fn travel_mm(&self) -> f64 {
        (**self).travel_mm()
    }

    fn home(&mut self) -> Result<(), StageError> {
        (**self).home()
    }

    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError> {
        (**self).move_to(position_mm)
    }

    fn state(&mut self) -> Result<StageState, StageError> {
        (**self).state()
    }

    fn stop(&mut self) -> Result<(), StageError> {
        (**self).stop()
    }

    fn stop_switch(&self) -> StopSwitch {
        (**self).stop_switch()
    }

    fn home_shift_mm(&self) -> Option<f64> {
        (**self).home_shift_mm()
    }

    fn expected_duration(&self, distance_mm: f64) -> Option<Duration> {
        (**self).expected_duration(distance_mm)
    }

    fn holds_at_rest(&self) -> Option<bool> {
        (**self).holds_at_rest()
    }
}

/// `position_mm` if it lies on a travel.
fn on_travel(position_mm: f64, travel_mm: f64) -> Result<f64, StageError> {
    if (0.0..=travel_mm).contains(&position_mm) {
        Ok(position_mm)
    } else {
        Err(StageError::OutsideTravel { position_mm, travel_mm })
    }
}
