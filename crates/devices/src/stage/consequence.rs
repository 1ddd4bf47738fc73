//! Consequences of the faults of a stage: one table for all dialects.

use super::StageError;
use crate::link::LinkError;
use epirig_core::fault::{Blame, Fault};

/// Consequences of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Consequence {
    /// What happens to the position.
    pub position: PositionAfter,
    /// What helps.
    pub remedy: Remedy,
    /// Who must act.
    pub blame: Blame,
}

/// The reported position after a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PositionAfter {
    /// Still valid: nothing moved, or the stage stopped with a ramp.
    Kept,
    /// Invalid until the stage is homed. No steps were lost, because a stage without its host decelerates
    /// before it stops.
    Unsure,
    /// Invalid until the stage is homed, and steps may have been lost.
    Lost,
}

/// The remedy for a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remedy {
    /// Another command: the same one would fail again, or the stop was wanted.
    AnotherOrder,
    /// Homing, then the same command again.
    HomeAgain,
    /// Waiting until the stage answers again, then homing and the same command again.
    WaitThenHome,
}

const fn means(position: PositionAfter, remedy: Remedy, blame: Blame) -> Consequence {
    Consequence { position, remedy, blame }
}

impl StageError {
    /// Consequences for the position, for resuming, and for the exit code.
    pub fn consequence(&self) -> Consequence {
        use PositionAfter::{Kept, Lost, Unsure};
        use Remedy::{AnotherOrder, HomeAgain, WaitThenHome};
        match self {
            Self::OutsideTravel { .. } | Self::NoApproach { .. } => means(Kept, AnotherOrder, Blame::Request),
            // A person has held it, so it does not go on by itself.
            Self::Held { .. } => means(Kept, AnotherOrder, Blame::Device),
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

impl Fault for StageError {
    fn blame(&self) -> Blame {
        self.consequence().blame
    }
}

impl Fault for LinkError {
    fn blame(&self) -> Blame {
        match self {
            Self::Ambiguous { .. } => Blame::Request,
            Self::Io { .. } => Blame::System,
            Self::NoSuchPort { .. }
            | Self::NoMatch { .. }
            | Self::Busy { .. }
            | Self::Permission { .. }
            | Self::NotOnThisSystem { .. } => Blame::NoDevice,
            Self::Lost { .. } | Self::Diverged { .. } => Blame::Device,
        }
    }
}
