//! Cameras where there is no Linux: an error that says so.

use std::time::Duration;

use super::{Camera, CameraError, CameraIdentity, Size};
use epirig_core::frame::Frame;

fn not_here<T>(camera: &str) -> Result<T, CameraError> {
    Err(CameraError::NotOnThisSystem(camera.to_owned()))
}

/// The cameras of this machine.
///
/// # Errors
/// Always [`CameraError::NotOnThisSystem`].
pub fn cameras() -> Result<Vec<CameraIdentity>, CameraError> {
    not_here("a camera")
}

/// Opens a real camera.
///
/// # Errors
/// Always [`CameraError::NotOnThisSystem`].
pub fn open_camera(path: &str) -> Result<Box<dyn Camera>, CameraError> {
    not_here(path)
}

/// On Linux, a video output of this machine.
#[derive(Debug)]
pub enum VideoOutput {}

impl VideoOutput {
    /// Opens an output.
    ///
    /// # Errors
    /// Always [`CameraError::NotOnThisSystem`].
    pub fn open(path: &str, _size: Size) -> Result<Self, CameraError> {
        not_here(path)
    }

    /// Whether the output still exists.
    ///
    /// # Errors
    /// None: there is no output.
    pub fn check(&self) -> Result<(), CameraError> {
        match *self {}
    }

    /// Shows a picture.
    ///
    /// # Errors
    /// None: there is no output.
    pub fn show(&mut self, _frame: &Frame, _patience: Duration) -> Result<bool, CameraError> {
        match *self {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_without_v4l2_says_so() {
        let size = Size { columns: 640, rows: 480 };
        let errors =
            [cameras().err(), open_camera("/dev/video0").err(), VideoOutput::open("/dev/video1", size).err()];
        for error in errors {
            assert!(error.unwrap().to_string().contains("epirig opens cameras on Linux only"));
        }
    }
}
