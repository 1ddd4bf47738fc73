//! Meaning of the kernel's errors.

use std::io;

use rustix::io::Errno;

use crate::camera::CameraError;

/// Whether the error means that the device is lost.
fn is_gone(error: &io::Error) -> bool {
    [Errno::NODEV, Errno::NXIO, Errno::SHUTDOWN].iter().any(|gone| is(error, *gone))
}

/// Whether an error has this number.
pub(super) fn is(error: &io::Error, errno: Errno) -> bool {
    error.raw_os_error() == Some(errno.raw_os_error())
}

/// An error of a call outside the stream.
pub(super) fn failed(camera: &str, action: &'static str) -> impl FnOnce(io::Error) -> CameraError + use<> {
    let camera = camera.to_owned();
    move |error| match error {
        error if is_gone(&error) => CameraError::Gone { camera },
        error if is(&error, Errno::BUSY) => CameraError::Busy { camera },
        error if is(&error, Errno::NOTTY) => {
            CameraError::NotACamera { camera, reason: format!("its driver cannot {action}") }
        }
        error => CameraError::System { camera, action, detail: error.to_string() },
    }
}

/// An error of a control call. Occasional USB errors may be cured by a restart.
pub(super) fn control_failed(
    camera: &str,
    action: &'static str,
) -> impl FnOnce(io::Error) -> CameraError + use<> {
    const PASSING: [Errno; 4] = [Errno::IO, Errno::PIPE, Errno::PROTO, Errno::TIMEDOUT];
    let camera = camera.to_owned();
    move |error| match error {
        error if is_gone(&error) => CameraError::Gone { camera },
        error if PASSING.iter().any(|passing| is(&error, *passing)) => {
            CameraError::Stream { camera, action, detail: error.to_string() }
        }
        error => CameraError::System { camera, action, detail: error.to_string() },
    }
}

/// An error of a stream call, which a restart may cure.
pub(super) fn broken(camera: &str, action: &'static str) -> impl FnOnce(io::Error) -> CameraError + use<> {
    let camera = camera.to_owned();
    move |error| match error {
        error if is_gone(&error) => CameraError::Gone { camera },
        error if is(&error, Errno::BUSY) => CameraError::Busy { camera },
        error if is(&error, Errno::NOSPC) => CameraError::System {
            camera,
            action,
            detail:
                "its USB bus has no bandwidth left; connect the camera to another bus, or choose a lower rate"
                    .to_owned(),
        },
        // For sensors behind a media controller: links or formats do not match.
        error if is(&error, Errno::PIPE) => CameraError::System {
            camera,
            action,
            detail: format!("{error}; set up its media pipeline (`media-ctl`) first"),
        },
        error => CameraError::Stream { camera, action, detail: error.to_string() },
    }
}

/// An error of opening the device.
pub(super) fn unopened(camera: &str) -> impl FnOnce(io::Error) -> CameraError + use<> {
    let camera = camera.to_owned();
    move |error| match error.kind() {
        io::ErrorKind::NotFound => CameraError::NoSuchCamera { camera },
        io::ErrorKind::PermissionDenied => CameraError::Permission { camera },
        _ if is_gone(&error) => CameraError::Gone { camera },
        _ if is(&error, Errno::BUSY) => CameraError::Busy { camera },
        _ if is(&error, Errno::ISDIR) => {
            CameraError::NotACamera { camera, reason: "it is a folder".to_owned() }
        }
        _ => CameraError::System { camera, action: "open", detail: error.to_string() },
    }
}
