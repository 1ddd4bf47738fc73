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
    /// What helps, and who must act.
    fn consequence(&self) -> (CameraRemedy, Blame) {
        use CameraRemedy::{AnotherOrder, Reconnect, StartAnew};
        match self {
            Self::Gone { .. } | Self::NoSignal { .. } => (Reconnect, Blame::Device),
            Self::Timeout { .. }
            | Self::Unsteady { .. }
            | Self::Stream { .. }
            | Self::Silent { .. }
            | Self::ControlUnanswered { .. }
            | Self::ControlChanged { .. }
            | Self::Substituted { .. }
            | Self::System { .. } => (StartAnew, Blame::Device),
            Self::NoSuchCamera { .. }
            | Self::NoMatch { .. }
            | Self::NotACamera { .. }
            | Self::Busy { .. }
            | Self::Permission { .. }
            | Self::NotOnThisSystem { .. } => (AnotherOrder, Blame::NoDevice),
            Self::Ambiguous { .. }
            | Self::NotOffered { .. }
            | Self::NoSuchControl { .. }
            | Self::ControlRefused { .. } => (AnotherOrder, Blame::Request),
            Self::Sequence(error) => (AnotherOrder, error.blame()),
            Self::Exhausted { .. } => (AnotherOrder, Blame::Data),
            Self::AnotherCamera { .. }
            | Self::AnotherSocket { .. }
            | Self::NotStarted { .. }
            | Self::ReconnectTimeout { .. }
            | Self::Frame(_)
            | Self::Interrupted { .. }
            | Self::Unsupported { .. } => (AnotherOrder, Blame::Device),
        }
    }

    /// The remedy.
    pub fn remedy(&self) -> CameraRemedy {
        self.consequence().0
    }
}

impl Fault for CameraError {
    fn blame(&self) -> Blame {
        self.consequence().1
    }
}
