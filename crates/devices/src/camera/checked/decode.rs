//! From a filled buffer to a frame.

use crate::camera::CameraError;
use crate::camera::device::{FilledBuffer, VideoDevice};
use crate::camera::pixels::Layout;
use epirig_core::frame::Frame;

/// Why a buffer gives no frame.
pub(super) enum Damage {
    /// The contents are damaged; the next buffer may be good.
    Frame(String),
    /// The device has failed.
    Device(CameraError),
}

/// The frame in a buffer that has not yet been queued again.
pub(super) fn decode(
    device: &mut dyn VideoDevice,
    buffer: &FilledBuffer,
    layout: &Layout,
) -> Result<Frame, Damage> {
    if buffer.damaged {
        return Err(Damage::Frame("the driver reports an error".to_owned()));
    }
    let needed = layout.format.image_bytes(layout.rows, layout.stride).unwrap_or(1);
    if buffer.bytes_used < needed {
        let reason = format!("{} of {needed} bytes were received", buffer.bytes_used);
        return Err(Damage::Frame(reason));
    }
    let bytes = device.bytes(buffer).map_err(Damage::Device)?;
    layout.decode(bytes).map_err(|error| Damage::Frame(error.to_string()))
}
