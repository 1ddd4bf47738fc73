//! The camera.

mod sim;

use thiserror::Error;

use crate::frame::Frame;

pub use sim::SimCamera;

/// Why a camera gave no frame.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// The camera has gone.
    #[error("the camera no longer answers; check its cable and start again")]
    Gone,
}

/// A frame with what the camera says of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TakenFrame {
    /// The image.
    pub frame: Frame,
    /// The camera's own count of frames, wrapping.
    pub sequence: u32,
}

/// A camera whose frames show the scene as it was when they were asked for.
pub trait Camera: Send {
    /// What it is, for records and messages.
    fn identity(&self) -> String;
    /// Takes one frame.
    ///
    /// # Errors
    /// [`CameraError`] if the camera gave none.
    fn grab(&mut self) -> Result<TakenFrame, CameraError>;
}
