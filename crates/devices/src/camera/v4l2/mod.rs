//! Cameras on Linux: Video4Linux2, single-planar, memory-mapped streaming.

mod device;
mod discover;
mod failure;
mod kernel;
mod output;

pub use device::V4l2Device;
pub use discover::cameras;
pub use output::VideoOutput;

use super::{Camera, CameraError, CheckedCamera};

/// A real camera with checked frames.
pub type V4l2Camera = CheckedCamera<V4l2Device>;

/// Opens a real camera by the path of its device.
///
/// # Errors
/// As [`V4l2Device::open`].
pub fn open_camera(path: &str) -> Result<Box<dyn Camera>, CameraError> {
    Ok(Box::new(V4l2Camera::new(V4l2Device::open(path)?)))
}
