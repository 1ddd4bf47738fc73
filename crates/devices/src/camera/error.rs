//! Errors of a camera.

use std::time::Duration;

use thiserror::Error;

use epirig_core::frame::FrameError;
use epirig_data::sequence::SequenceError;

/// Error of a camera: it cannot be used, or gave no good frame. A text alone is the name of the camera.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// There is no such device.
    #[error("there is no camera {0}; check cable and power, and see `epirig devices`")]
    NoSuchCamera(String),
    /// No camera matches.
    #[error(
        "{wanted} is not connected (connected: {connected}); check cable and power, or name the camera with --camera"
    )]
    NoMatch {
        /// The name as given.
        wanted: String,
        /// The connected cameras.
        connected: String,
    },
    /// Several cameras match.
    #[error("{wanted} could be any of {candidates}; choose one with --camera")]
    Ambiguous {
        /// The name as given.
        wanted: String,
        /// The matching cameras.
        candidates: String,
    },
    /// Another camera was connected in its place.
    #[error(
        "{path} is now {found}, but was {expected}; connect the same camera to the same socket, or start again"
    )]
    AnotherCamera {
        /// Path of the device.
        path: String,
        /// The former camera.
        expected: String,
        /// The present camera.
        found: String,
    },
    /// A camera like it has been connected in another socket, and it may be another one.
    #[error(
        "{found} may be {camera} in another socket, but {why}; put it back into its own socket, then continue"
    )]
    AnotherSocket {
        /// The former camera.
        camera: String,
        /// The present camera.
        found: String,
        /// Why it is not known to be the same.
        why: &'static str,
    },
    /// The device gives no images that can be decoded.
    #[error("{camera} cannot be used as a camera: {reason}")]
    NotACamera {
        /// The device.
        camera: String,
        /// What it lacks.
        reason: String,
    },
    /// The user may not open the device.
    #[error(
        "no permission to open {0}; add yourself to its group (`sudo usermod -aG video $USER`, then log in again)"
    )]
    Permission(String),
    /// Another program uses the camera.
    #[error("{0} is in use by another program; end that program first")]
    Busy(String),
    /// The camera is disconnected.
    #[error(
        "{0} has gone: cable or power is off, or the driver is unloaded; connect it again, then continue"
    )]
    Gone(String),
    /// The program does not know the cameras of this system.
    #[error(
        "{0} cannot be opened: epirig opens cameras on Linux only (V4L2); here it has simulated and replayed ones (`--camera sim`, `--camera replay:FOLDER`)"
    )]
    NotOnThisSystem(String),
    /// The camera does not offer what is wanted.
    #[error("{camera} has no {wanted}; it offers {offered}")]
    NotOffered {
        /// The camera.
        camera: String,
        /// What is wanted.
        wanted: String,
        /// What is offered.
        offered: String,
    },
    /// The driver has set something else.
    #[error("{camera} was asked for {asked} and silently took {got}; choose another setting")]
    Substituted {
        /// The camera.
        camera: String,
        /// The wanted setting.
        asked: String,
        /// The setting of the driver.
        got: String,
    },
    /// There is no such control.
    #[error("{camera} has no control {name}{}", suggestion(.nearest))]
    NoSuchControl {
        /// The camera.
        camera: String,
        /// The name as given.
        name: String,
        /// The most similar name.
        nearest: Option<String>,
    },
    /// A control refuses a value.
    #[error("{camera}: {name} cannot be {value}: {reason}")]
    ControlRefused {
        /// The camera.
        camera: String,
        /// The control.
        name: String,
        /// The wanted value.
        value: String,
        /// The reason.
        reason: String,
    },
    /// A control did not answer.
    #[error(
        "{camera}: {name} cannot be {request}: {reason}; if that stays so, pull the camera's cable and put it back"
    )]
    ControlUnanswered {
        /// The camera.
        camera: String,
        /// The control.
        name: String,
        /// What was asked for: "read", or "set to" a value.
        request: String,
        /// The reason.
        reason: String,
    },
    /// A control has changed.
    #[error(
        "{camera}: {name} was set to {set} and reads {found}; check for another program that changes it, and for automatic controls"
    )]
    ControlChanged {
        /// The camera.
        camera: String,
        /// The control.
        name: String,
        /// The value that was set.
        set: i64,
        /// The value that was read.
        found: i64,
    },
    /// The input has no usable signal.
    #[error("{camera} has {what}; check what is connected to its input")]
    NoSignal {
        /// The camera.
        camera: String,
        /// What is wrong with the signal.
        what: String,
    },
    /// The camera has not been started.
    #[error("{0} has not been started")]
    NotStarted(String),
    /// Nothing came for a while from a stream that runs.
    #[error("{camera} has sent nothing for {:.2} s", time.as_secs_f64())]
    Silent {
        /// The camera.
        camera: String,
        /// How long.
        time: Duration,
    },
    /// No good frame was received.
    #[error("{camera} gave no good frame within {:.2} s: {why}", patience.as_secs_f64())]
    Timeout {
        /// The camera.
        camera: String,
        /// The time-out.
        patience: Duration,
        /// What was received instead.
        why: String,
    },
    /// The camera did not return.
    #[error("{camera} did not reconnect within {:.0} s: {why}", patience.as_secs_f64())]
    ReconnectTimeout {
        /// The camera.
        camera: String,
        /// The time-out.
        patience: Duration,
        /// The last error.
        why: String,
    },
    /// Frames of one view differ from each other.
    #[error(
        "{camera} shows no steady picture: {why}; check the lamp, the exposure (a multiple of 10 ms at 50 Hz mains, of 8.33 ms at \
         60 Hz) and that nothing moves"
    )]
    Unsteady {
        /// The camera.
        camera: String,
        /// How the frames differ.
        why: String,
    },
    /// The stream has failed.
    #[error("{camera}: cannot {action}: {detail}")]
    Stream {
        /// The camera.
        camera: String,
        /// The operation.
        action: &'static str,
        /// The message of the system.
        detail: String,
    },
    /// Another error of the operating system.
    #[error("{camera}: cannot {action}: {detail}")]
    System {
        /// The camera.
        camera: String,
        /// The operation.
        action: &'static str,
        /// The message of the system.
        detail: String,
    },
    /// Averaged samples do not form a frame.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A replayed sequence cannot be read.
    #[error(transparent)]
    Sequence(#[from] SequenceError),
    /// A replayed sequence has no more frames.
    #[error("{camera} has ended: all of its {frames} frames have been taken")]
    Exhausted {
        /// The sequence.
        camera: String,
        /// Its number of frames.
        frames: usize,
    },
    /// Stopped by the caller.
    #[error("{0}: stopped")]
    Interrupted(String),
    /// This kind of camera does not support the operation.
    #[error("{camera} cannot {what}")]
    Unsupported {
        /// The camera.
        camera: String,
        /// The operation.
        what: &'static str,
    },
}

fn suggestion(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(
        || "; see `epirig camera get`".to_owned(),
        |name| format!("; did you mean {name}? `epirig camera get` lists all"),
    )
}

impl CameraError {
    /// The device gives no images that can be decoded.
    pub(super) fn not_a_camera(camera: &str, reason: impl Into<String>) -> Self {
        Self::NotACamera { camera: camera.to_owned(), reason: reason.into() }
    }

    /// The camera does not offer what is wanted.
    pub(super) fn not_offered(camera: &str, wanted: impl Into<String>, offered: impl Into<String>) -> Self {
        Self::NotOffered { camera: camera.to_owned(), wanted: wanted.into(), offered: offered.into() }
    }

    /// The driver has set something else.
    pub fn substituted(camera: &str, asked: impl ToString, got: impl ToString) -> Self {
        Self::Substituted { camera: camera.to_owned(), asked: asked.to_string(), got: got.to_string() }
    }

    /// Whether a restart of the camera may help.
    pub(super) fn is_mended_by_restart(&self) -> bool {
        matches!(
            self,
            Self::Stream { .. }
                | Self::Silent { .. }
                | Self::ControlUnanswered { .. }
                | Self::ControlChanged { .. }
        )
    }
}
