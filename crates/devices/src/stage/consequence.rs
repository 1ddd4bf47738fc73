//! What each fault of a stage means: one table for all dialects and for all who handle faults.

use super::StageError;
use crate::blame::Blame;
use crate::link::LinkError;

/// What a fault means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Consequence {
    /// What is left of the position.
    pub position: PositionAfter,
    /// What helps.
    pub remedy: Remedy,
    /// Whose trouble it is.
    pub blame: Blame,
}

/// What a fault leaves of the position that the stage reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PositionAfter {
    /// It is as good as before: nothing moved, or the stage stopped with a ramp.
    Kept,
    /// It is not to be believed before the stage is homed. No steps can have been lost: a stage whose host is
    /// silent slows down before it stops.
    Unsure,
    /// It is not to be believed before the stage is homed, and steps may have been lost.
    Lost,
}

/// What helps after a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remedy {
    /// Another order: the same one fails again, or a person wanted the stop.
    AnotherOrder,
    /// Homing, then the same order again.
    HomeAgain,
    /// Waiting until the stage is heard again, then homing and the same order again.
    WaitThenHome,
}

const fn means(position: PositionAfter, remedy: Remedy, blame: Blame) -> Consequence {
    Consequence { position, remedy, blame }
}

impl StageError {
    /// What it means: of the position, for who goes on, and for the exit code.
    pub fn consequence(&self) -> Consequence {
        use PositionAfter::{Kept, Lost, Unsure};
        use Remedy::{AnotherOrder, HomeAgain, WaitThenHome};
        match self {
            Self::OutsideTravel { .. } | Self::NoApproach { .. } => means(Kept, AnotherOrder, Blame::Request),
            Self::Stopped { position_mm: Some(_) } => means(Kept, AnotherOrder, Blame::Interruption),
            Self::Stopped { position_mm: None } => means(Lost, AnotherOrder, Blame::Interruption),
            Self::Link(error) => means(Unsure, WaitThenHome, error.blame()),
            Self::NoAnswer { .. } | Self::Restarted { .. } => means(Lost, WaitThenHome, Blame::Device),
            // Refused before anything moved.
            Self::Refused { .. } => means(Kept, HomeAgain, Blame::Device),
            Self::NotHomed
            | Self::Foreign { .. }
            | Self::Unsuitable { .. }
            | Self::Fault { .. }
            | Self::Disagrees { .. }
            | Self::TooFast { .. }
            | Self::TooSlow { .. } => means(Lost, HomeAgain, Blame::Device),
        }
    }
}

impl LinkError {
    /// Whose trouble it is.
    pub fn blame(&self) -> Blame {
        match self {
            Self::Ambiguous { .. } => Blame::Request,
            Self::Io { .. } => Blame::System,
            Self::NoSuchPort { .. }
            | Self::NoMatch { .. }
            | Self::Busy { .. }
            | Self::Permission { .. }
            | Self::NotBuilt { .. } => Blame::NoDevice,
            Self::Lost { .. } | Self::Diverged { .. } => Blame::Device,
        }
    }
}
