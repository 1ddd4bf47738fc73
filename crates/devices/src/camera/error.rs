//! What can be wrong with a camera.

use std::time::Duration;

use thiserror::Error;

use epirig_core::frame::FrameError;
use epirig_data::sequence::SequenceError;

/// Why a camera cannot be used, or gave no frame that can be trusted.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// There is no such device.
    #[error("there is no camera {camera}; check cable and power, and see `epirig devices`")]
    NoSuchCamera {
        /// As it was asked for.
        camera: String,
    },
    /// No camera is what was asked for.
    #[error(
        "{wanted} is not connected (there is: {connected}); check cable and power, or name the camera with --camera"
    )]
    NoMatch {
        /// As it was asked for.
        wanted: String,
        /// The cameras there are.
        connected: String,
    },
    /// More than one camera is what was asked for.
    #[error("{wanted} could be any of {candidates}; choose one with --camera")]
    Ambiguous {
        /// As it was asked for.
        wanted: String,
        /// The cameras that would do.
        candidates: String,
    },
    /// What returned is another camera.
    #[error(
        "{path} is now {found}, but was {expected}; connect the same camera to the same socket, or start again"
    )]
    AnotherCamera {
        /// Path of the device.
        path: String,
        /// What it was.
        expected: String,
        /// What it is.
        found: String,
    },
    /// The device gives no images in a way that is understood.
    #[error("{camera} cannot be used as a camera: {reason}")]
    NotACamera {
        /// The device.
        camera: String,
        /// What it lacks.
        reason: String,
    },
    /// The user may not open the device.
    #[error(
        "no permission to open {camera}; add yourself to its group (`sudo usermod -aG video $USER`, then log in again)"
    )]
    Permission {
        /// The device.
        camera: String,
    },
    /// Another program uses the camera.
    #[error("{camera} is in use by another program; end that first")]
    Busy {
        /// The device.
        camera: String,
    },
    /// The camera has gone.
    #[error("{camera} has gone: cable pulled, power lost or driver unloaded; connect it and go on")]
    Gone {
        /// The camera.
        camera: String,
    },
    /// The program was built without real cameras.
    #[error(
        "{camera} cannot be opened: this epirig was built without cameras; build it with `--features v4l2` (needs libclang)"
    )]
    NotBuilt {
        /// As it was asked for.
        camera: String,
    },
    /// The camera does not offer what was asked for.
    #[error("{camera} has no {wanted}; it offers {offered}")]
    NotOffered {
        /// The camera.
        camera: String,
        /// What was asked for.
        wanted: String,
        /// What there is.
        offered: String,
    },
    /// The driver took something else than it was asked for.
    #[error("{camera} was asked for {asked} and silently took {got}; ask for something else")]
    Substituted {
        /// The camera.
        camera: String,
        /// What was asked for.
        asked: String,
        /// What the driver has set.
        got: String,
    },
    /// There is no such control.
    #[error("{camera} has no control {name}{}", suggestion(.nearest))]
    NoSuchControl {
        /// The camera.
        camera: String,
        /// As it was asked for.
        name: String,
        /// The name most like it.
        nearest: Option<String>,
    },
    /// A control does not take a value.
    #[error("{camera}: {name} cannot be {value}: {reason}")]
    ControlRefused {
        /// The camera.
        camera: String,
        /// The control.
        name: String,
        /// What it was to be.
        value: String,
        /// Why it cannot be.
        reason: String,
    },
    /// A control is not what it was set to.
    #[error(
        "{camera}: {name} was set to {set} and reads {found}; does another program change it, or an automatism still run?"
    )]
    ControlChanged {
        /// The camera.
        camera: String,
        /// The control.
        name: String,
        /// What it was set to.
        set: i64,
        /// What it reads.
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
    /// A frame was asked of a camera that has not been started.
    #[error("{camera} has not been started")]
    NotStarted {
        /// The camera.
        camera: String,
    },
    /// No frame came that could be accepted.
    #[error("{camera} gave no good frame within {:.2} s: {why}", patience.as_secs_f64())]
    Timeout {
        /// The camera.
        camera: String,
        /// How long was waited.
        patience: Duration,
        /// What came instead.
        why: String,
    },
    /// The camera did not come back.
    #[error("{camera} did not come back within {:.0} s: {why}", patience.as_secs_f64())]
    ReconnectTimeout {
        /// The camera.
        camera: String,
        /// How long was waited.
        patience: Duration,
        /// The latest reason.
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
    /// The stream of frames has broken down.
    #[error("{camera}: cannot {action}: {detail}")]
    Stream {
        /// The camera.
        camera: String,
        /// What was being done.
        action: &'static str,
        /// What the system said.
        detail: String,
    },
    /// The system refused something else.
    #[error("{camera}: cannot {action}: {detail}")]
    System {
        /// The camera.
        camera: String,
        /// What was being done.
        action: &'static str,
        /// What the system said.
        detail: String,
    },
    /// Averaged samples make no frame.
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
        /// How many frames it had.
        frames: usize,
    },
    /// Somebody said that enough is enough.
    #[error("{camera}: stopped")]
    Interrupted {
        /// The camera.
        camera: String,
    },
    /// The kind of camera cannot do that.
    #[error("{camera} cannot {what}")]
    Unsupported {
        /// The camera.
        camera: String,
        /// What was asked of it.
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
    /// Whether setting the camera up anew may mend it.
    pub(super) fn is_mended_by_restart(&self) -> bool {
        matches!(self, Self::Stream { .. } | Self::ControlChanged { .. })
    }
}
