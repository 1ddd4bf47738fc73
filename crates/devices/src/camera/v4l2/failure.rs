//! What the kernel's errors mean.

use std::io;

use rustix::io::Errno;

use crate::camera::CameraError;

/// Whether the kernel says that the device is no more.
fn is_gone(error: &io::Error) -> bool {
    [Errno::NODEV, Errno::NXIO, Errno::SHUTDOWN].iter().any(|gone| is(error, *gone))
}

/// Whether an error is of this number.
pub(super) fn is(error: &io::Error, errno: Errno) -> bool {
    error.raw_os_error() == Some(errno.raw_os_error())
}

/// Of a call that is not about the stream.
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

/// Of a call about a control. What USB does badly now and then may be mended by starting anew.
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

/// Of a call on a stream, which may be mended by starting anew.
pub(super) fn broken(camera: &str, action: &'static str) -> impl FnOnce(io::Error) -> CameraError + use<> {
    let camera = camera.to_owned();
    move |error| match error {
        error if is_gone(&error) => CameraError::Gone { camera },
        error if is(&error, Errno::BUSY) => CameraError::Busy { camera },
        error if is(&error, Errno::NOSPC) => CameraError::System {
            camera,
            action,
            detail:
                "its USB bus has no bandwidth left; give the camera a bus of its own, or choose a lower rate"
                    .to_owned(),
        },
        // Sensors behind a media controller: its links, or their formats, do not fit.
        error if is(&error, Errno::PIPE) => CameraError::System {
            camera,
            action,
            detail: format!("{error}; set up its media pipeline (`media-ctl`) first"),
        },
        error => CameraError::Stream { camera, action, detail: error.to_string() },
    }
}

/// Of opening the device.
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
