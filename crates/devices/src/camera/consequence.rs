//! What each fault of a camera means: one table for all drivers and for all who handle faults.

use super::CameraError;
use crate::blame::Blame;

/// What helps after a fault of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraRemedy {
    /// Another order: the same one fails again, or a person wanted the stop.
    AnotherOrder,
    /// Starting the stream anew, and the same order again.
    StartAnew,
    /// Waiting until the camera is there again. What its cable has pushed is not where it was: the stage is homed, too.
    Reconnect,
}

impl CameraError {
    /// What helps.
    pub fn remedy(&self) -> CameraRemedy {
        match self {
            Self::Gone { .. } | Self::NoSignal { .. } => CameraRemedy::Reconnect,
            Self::Timeout { .. }
            | Self::Unsteady { .. }
            | Self::Stream { .. }
            | Self::ControlChanged { .. }
            | Self::Substituted { .. }
            | Self::System { .. } => CameraRemedy::StartAnew,
            Self::NoSuchCamera { .. }
            | Self::NoMatch { .. }
            | Self::Ambiguous { .. }
            | Self::AnotherCamera { .. }
            | Self::NotACamera { .. }
            | Self::Permission { .. }
            | Self::Busy { .. }
            | Self::NotBuilt { .. }
            | Self::NotOffered { .. }
            | Self::NoSuchControl { .. }
            | Self::ControlRefused { .. }
            | Self::NotStarted { .. }
            | Self::ReconnectTimeout { .. }
            | Self::Frame(_)
            | Self::Sequence(_)
            | Self::Exhausted { .. }
            | Self::Interrupted { .. }
            | Self::Unsupported { .. } => CameraRemedy::AnotherOrder,
        }
    }

    /// Whose trouble it is.
    pub fn blame(&self) -> Blame {
        match self {
            Self::NoSuchCamera { .. }
            | Self::NoMatch { .. }
            | Self::NotACamera { .. }
            | Self::Busy { .. }
            | Self::Permission { .. }
            | Self::NotBuilt { .. } => Blame::NoDevice,
            Self::Ambiguous { .. }
            | Self::NotOffered { .. }
            | Self::NoSuchControl { .. }
            | Self::ControlRefused { .. } => Blame::Request,
            Self::Sequence(_) | Self::Exhausted { .. } => Blame::Data,
            Self::AnotherCamera { .. }
            | Self::Gone { .. }
            | Self::Substituted { .. }
            | Self::ControlChanged { .. }
            | Self::NoSignal { .. }
            | Self::NotStarted { .. }
            | Self::Timeout { .. }
            | Self::ReconnectTimeout { .. }
            | Self::Unsteady { .. }
            | Self::Stream { .. }
            | Self::System { .. }
            | Self::Frame(_)
            | Self::Interrupted { .. }
            | Self::Unsupported { .. } => Blame::Device,
        }
    }
}
