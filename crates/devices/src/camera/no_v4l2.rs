//! Cameras where there is no Linux: an error that says so.

use std::time::Duration;

use super::pixels::FourCc;
use super::{
    ActiveFormat, CameraError, CameraIdentity, Control, FilledBuffer, Interval, Moment, OfferedFormat, Size,
    VideoDevice,
};
use epirig_core::frame::Frame;

fn not_here<T>(camera: &str) -> Result<T, CameraError> {
    Err(CameraError::NotOnThisSystem { camera: camera.to_owned() })
}

/// The cameras of this machine.
///
/// # Errors
/// Always [`CameraError::NotOnThisSystem`].
pub fn cameras() -> Result<Vec<CameraIdentity>, CameraError> {
    not_here("a camera")
}

/// On Linux, a video device of this machine.
#[derive(Debug)]
pub enum V4l2Device {}

impl V4l2Device {
    /// Opens a device.
    ///
    /// # Errors
    /// Always [`CameraError::NotOnThisSystem`].
    pub fn open(path: &str) -> Result<Self, CameraError> {
        not_here(path)
    }
}

impl VideoDevice for V4l2Device {
    fn identity(&self) -> CameraIdentity {
        match *self {}
    }

    fn now(&mut self) -> Moment {
        match *self {}
    }

    fn pause(&mut self, _time: Duration) {
        match *self {}
    }

    fn offered(&mut self) -> Result<Vec<OfferedFormat>, CameraError> {
        match *self {}
    }

    fn active_format(&mut self) -> Result<ActiveFormat, CameraError> {
        match *self {}
    }

    fn set_format(&mut self, _four_cc: FourCc, _size: Size) -> Result<ActiveFormat, CameraError> {
        match *self {}
    }

    fn interval(&mut self) -> Result<Option<Interval>, CameraError> {
        match *self {}
    }

    fn set_interval(&mut self, _interval: Interval) -> Result<(), CameraError> {
        match *self {}
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        match *self {}
    }

    fn read_control(&mut self, _id: u32) -> Result<i64, CameraError> {
        match *self {}
    }

    fn write_control(&mut self, _id: u32, _value: i64) -> Result<(), CameraError> {
        match *self {}
    }

    fn check_signal(&mut self) -> Result<(), CameraError> {
        match *self {}
    }

    fn start(&mut self, _buffers: usize) -> Result<usize, CameraError> {
        match *self {}
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        match *self {}
    }

    fn dequeue(&mut self, _patience: Duration) -> Result<Option<FilledBuffer>, CameraError> {
        match *self {}
    }

    fn bytes(&mut self, _buffer: &FilledBuffer) -> Result<&[u8], CameraError> {
        match *self {}
    }

    fn requeue(&mut self, _buffer: FilledBuffer) -> Result<(), CameraError> {
        match *self {}
    }

    fn let_go(&mut self) {
        match *self {}
    }

    fn reopen(&mut self) -> Result<(), CameraError> {
        match *self {}
    }
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
        let errors = [
            cameras().err(),
            V4l2Device::open("/dev/video0").err(),
            VideoOutput::open("/dev/video1", size).err(),
        ];
        for error in errors {
            assert!(error.unwrap().to_string().contains("epirig opens cameras on Linux only"));
        }
    }
}
