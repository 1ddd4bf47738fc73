//! The motorised linear stage.

mod sim;

use thiserror::Error;

pub use sim::{SimStage, StagePosition};

/// Why a stage did not do what it was asked.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum StageError {
    /// The stage does not know where it is.
    #[error("the stage has not been homed, so its position is unknown; home it first")]
    NotHomed,
    /// The position lies outside the travel.
    #[error("{position_mm} mm lies outside the stage's travel of 0 to {travel_mm} mm; change the plan")]
    OutsideTravel {
        /// Position asked for, in mm from home.
        position_mm: f64,
        /// Length of the travel, in mm.
        travel_mm: f64,
    },
}

/// A linear stage that moves to absolute positions, in mm from home.
pub trait Stage: Send {
    /// What it is, for records and messages.
    fn identity(&self) -> String;
    /// Length of the travel, in mm.
    fn travel_mm(&self) -> f64;
    /// Finds the home position.
    ///
    /// # Errors
    /// [`StageError`] if home cannot be found.
    fn home(&mut self) -> Result<(), StageError>;
    /// Moves to `position_mm` and returns when the stage is at rest there.
    ///
    /// # Errors
    /// [`StageError`] if the stage is not homed, the position lies outside the travel, or the motion failed.
    fn move_to(&mut self, position_mm: f64) -> Result<(), StageError>;
    /// Where the stage reports to be, in mm from home.
    ///
    /// # Errors
    /// [`StageError`] if it is not homed or does not answer.
    fn position_mm(&mut self) -> Result<f64, StageError>;
}
