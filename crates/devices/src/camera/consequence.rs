//! Consequences of the faults of a camera: one table for all drivers.

use super::CameraError;
use epirig_core::fault::{Blame, Fault};

/// The remedy for a fault of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraRemedy {
    /// Another command: the same one would fail again, or the stop was wanted.
    AnotherOrder,
    /// Starting the stream again, then the same command.
    StartAnew,
    /// Waiting until the camera is connected again. The stage is homed too, because the cable may have moved
    /// something.
    Reconnect,
}

impl CameraError {
    /// The remedy.
    pub fn remedy(&self) -> CameraRemedy {
        match self {
            Self::Gone { .. } | Self::NoSignal { .. } => CameraRemedy::Reconnect,
            Self::Timeout { .. }
            | Self::Unsteady { .. }
            | Self::Stream { .. }
            | Self::Silent { .. }
            | Self::ControlUnanswered { .. }
            | Self::ControlChanged { .. }
            | Self::Substituted { .. }
            | Self::System { .. } => CameraRemedy::StartAnew,
            Self::NoSuchCamera { .. }
            | Self::NoMatch { .. }
            | Self::Ambiguous { .. }
            | Self::AnotherCamera { .. }
            | Self::AnotherSocket { .. }
            | Self::NotACamera { .. }
            | Self::Permission { .. }
            | Self::Busy { .. }
            | Self::NotOnThisSystem { .. }
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
}

impl Fault for CameraError {
    fn blame(&self) -> Blame {
        match self {
            Self::NoSuchCamera { .. }
            | Self::NoMatch { .. }
            | Self::NotACamera { .. }
            | Self::Busy { .. }
            | Self::Permission { .. }
            | Self::NotOnThisSystem { .. } => Blame::NoDevice,
            Self::Ambiguous { .. }
            | Self::NotOffered { .. }
            | Self::NoSuchControl { .. }
            | Self::ControlRefused { .. } => Blame::Request,
            Self::Sequence(error) => error.blame(),
            Self::Exhausted { .. } => Blame::Data,
            Self::AnotherCamera { .. }
            | Self::AnotherSocket { .. }
            | Self::Gone { .. }
            | Self::Substituted { .. }
            | Self::ControlChanged { .. }
            | Self::ControlUnanswered { .. }
            | Self::Silent { .. }
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
