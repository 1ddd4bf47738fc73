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

/// Gone, if the device is lost; else what `means` says of the error.
fn unless_gone<M>(camera: &str, means: M) -> impl FnOnce(io::Error) -> CameraError + use<M>
where
    M: FnOnce(String, io::Error) -> CameraError,
{
    let camera = camera.to_owned();
    move |error| if is_gone(&error) { CameraError::Gone(camera) } else { means(camera, error) }
}

/// An error of a call outside the stream.
pub(super) fn failed(camera: &str, action: &'static str) -> impl FnOnce(io::Error) -> CameraError + use<> {
    unless_gone(camera, move |camera, error| match error {
        error if is(&error, Errno::BUSY) => CameraError::Busy(camera),
        error if is(&error, Errno::NOTTY) => {
            CameraError::NotACamera { camera, reason: format!("its driver cannot {action}") }
        }
        error => CameraError::System { camera, action, detail: error.to_string() },
    })
}

/// What the driver reports of a control. `uvcvideo` asks a camera that refuses a request for its reason, and
/// makes an errno of the answer: EBUSY for "not ready", EILSEQ for "wrong state", EREMOTE for "power",
/// ERANGE for "out of range", EINVAL for "invalid value", EIO for the others, EPIPE for none.
fn control_reason(error: &io::Error) -> String {
    let means = [
        (Errno::BUSY, "the camera is not ready for it"),
        (Errno::ILSEQ, "the camera cannot do it in its present state; an automatic control may be on"),
        (Errno::REMOTE, "the camera has not enough power for it"),
        (Errno::RANGE, "the camera calls the value out of range"),
        (Errno::INVAL, "the camera or its driver calls the value invalid"),
        (Errno::ACCESS, "an automatic control is on that sets it"),
        (Errno::PIPE, "the camera refused the request without a reason"),
        (Errno::IO, "the camera does not know the request, or the transfer failed"),
    ];
    let known = means.iter().find(|(errno, _)| is(error, *errno));
    known.map_or_else(|| error.to_string(), |(_, meaning)| format!("{meaning} ({error})"))
}

/// An error of reading the control `name`. A restart may cure it.
pub(super) fn control_unread(camera: &str, name: String) -> impl FnOnce(io::Error) -> CameraError + use<> {
    unless_gone(camera, move |camera, error| {
        let reason = control_reason(&error);
        CameraError::ControlUnanswered { camera, name, request: "read".to_owned(), reason }
    })
}

/// An error of setting the control `name`. Errors of the bus, and those of a camera that is not ready, pass.
pub(super) fn control_unset(
    camera: &str,
    name: String,
    value: i64,
) -> impl FnOnce(io::Error) -> CameraError + use<> {
    const PASSING: [Errno; 5] = [Errno::IO, Errno::PIPE, Errno::PROTO, Errno::TIMEDOUT, Errno::BUSY];
    unless_gone(camera, move |camera, error| {
        let reason = control_reason(&error);
        if PASSING.iter().any(|passing| is(&error, *passing)) {
            return CameraError::ControlUnanswered {
                camera,
                name,
                request: format!("set to {value}"),
                reason,
            };
        }
        CameraError::System { camera, action: "set a control", detail: reason }
    })
}

/// An error of a stream call, which a restart may cure.
pub(super) fn broken(camera: &str, action: &'static str) -> impl FnOnce(io::Error) -> CameraError + use<> {
    unless_gone(camera, move |camera, error| match error {
        error if is(&error, Errno::BUSY) => CameraError::Busy(camera),
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
    })
}

/// An error of opening the device.
pub(super) fn unopened(camera: &str) -> impl FnOnce(io::Error) -> CameraError + use<> {
    unless_gone(camera, |camera, error| match error.kind() {
        io::ErrorKind::NotFound => CameraError::NoSuchCamera(camera),
        io::ErrorKind::PermissionDenied => CameraError::Permission(camera),
        _ if is(&error, Errno::BUSY) => CameraError::Busy(camera),
        _ if is(&error, Errno::ISDIR) => {
            CameraError::NotACamera { camera, reason: "it is a folder".to_owned() }
        }
        _ => CameraError::System { camera, action: "open", detail: error.to_string() },
    })
}
