//! What errors leave of the rig's state.

use super::CaptureError;
use epirig_devices::camera::CameraRemedy;
use epirig_devices::stage::{PositionAfter, Remedy};

/// How much of the rig's state is still valid, in falling order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Trust {
    /// Everything is as for the latest frame.
    Whole,
    /// The camera must be started again.
    CameraStopped,
    /// The position is lost.
    PositionLost,
    /// The camera was disconnected. The position counts as lost too, because the cable may have moved the
    /// carriage.
    CameraGone,
}

/// Whether the event behind an error may have cost steps.
pub(super) fn may_lose_steps(error: &CaptureError) -> bool {
    match error {
        CaptureError::Stage(error) => error.consequence().position != PositionAfter::Unsure,
        CaptureError::NoMotion { .. } => true,
        _ => false,
    }
}

/// What an error leaves of the rig's state; `None` if another attempt cannot help.
pub(super) fn lost_trust(error: &CaptureError) -> Option<Trust> {
    match error {
        CaptureError::Stage(error) => match error.consequence().remedy {
            Remedy::AnotherOrder => None,
            Remedy::HomeAgain | Remedy::WaitThenHome => Some(Trust::PositionLost),
        },
        CaptureError::NoMotion { .. } => Some(Trust::PositionLost),
        CaptureError::Camera(error) => match error.remedy() {
            CameraRemedy::AnotherOrder => None,
            CameraRemedy::StartAnew => Some(Trust::CameraStopped),
            CameraRemedy::Reconnect => Some(Trust::CameraGone),
        },
        CaptureError::Saturated { .. } | CaptureError::LightChanged { .. } => Some(Trust::Whole),
        _ => None,
    }
}
