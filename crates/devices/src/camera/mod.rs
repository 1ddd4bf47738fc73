//! The camera.
//!
//! [`Camera`] is what the rest of the program knows: it gives frames that were begun after a given moment, each with the facts
//! that make it trustworthy. [`CheckedCamera`] makes one of any [`VideoDevice`], which is a driver as it is: [`V4l2Device`] of a
//! real one, [`SimDevice`] of one that looks at the simulator, with faults by script. [`ReplayCamera`] gives the frames of a sequence.

mod assess;
mod automatic;
mod average;
mod checked;
mod configure;
mod consequence;
mod control;
mod device;
mod driver;
mod error;
mod format;
mod identity;
mod moment;
#[cfg(not(feature = "v4l2"))]
mod no_v4l2;
pub mod pixels;
mod replay;
mod settings;
mod sim;
mod stillness;
pub mod timing;
#[cfg(feature = "v4l2")]
mod v4l2;

use std::time::Duration;

pub use assess::Assessment;
pub use average::{AveragedFrame, average};
pub use checked::CheckedCamera;
pub use consequence::CameraRemedy;
pub use control::{Control, ControlKind, find_control};
pub use device::{FilledBuffer, StampSource, VideoDevice};
pub use driver::{CameraDriver, OpenCamera, Surroundings, add_camera_drivers, camera_driver, camera_drivers};
pub use error::CameraError;
pub use format::{ActiveFormat, Interval, OfferedFormat, Size, Sizes};
pub use identity::{CameraChoice, CameraIdentity, choose};
pub use moment::Moment;
#[cfg(not(feature = "v4l2"))]
pub use no_v4l2::{V4l2Device, VideoOutput, cameras};
pub use replay::ReplayCamera;
pub use settings::{CameraSettings, Configuration, Pinned};
pub use sim::{SimCamera, SimDevice, SimFault, SimStamps, SimView, ViewSwitch};
pub use stillness::Difference;
pub use timing::TimingRule;
#[cfg(feature = "v4l2")]
pub use v4l2::{V4l2Device, VideoOutput, cameras};

use epirig_core::frame::Frame;

/// A real camera whose frames can be trusted.
pub type V4l2Camera = CheckedCamera<V4l2Device>;

/// What is known of how a frame was taken.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameFacts {
    /// The moment after which it was to begin.
    pub requested: Moment,
    /// When its exposure began, at the earliest.
    pub exposure_start: Moment,
    /// How that is known.
    pub timing: TimingRule,
    /// The driver's own time stamp.
    pub stamp: Moment,
    /// When it was taken from the driver's queue.
    pub received: Moment,
    /// The driver's count of frames, wrapping.
    pub sequence: u32,
    /// The driver's flags.
    pub flags: u32,
    /// Frames that were passed over because they were begun too early.
    pub stale: usize,
    /// Frames that were passed over because they were damaged.
    pub damaged: usize,
    /// Frames that the driver lost meanwhile, by its count.
    pub missed: u32,
    /// Frames that were passed over because they did not show what the one before showed.
    pub unsteady: usize,
    /// How often the stream had to be set up anew.
    pub restarts: usize,
    /// Typical difference from the frame before, in DN: the noise of a difference. `None` if there is no such frame.
    pub difference_dn: Option<f64>,
    /// The watched controls and their values, read back after the frame was taken.
    pub controls: Vec<(String, i64)>,
}

/// A frame with what is known of how it was taken.
#[derive(Debug, Clone, PartialEq)]
pub struct TakenFrame {
    /// The image.
    pub frame: Frame,
    /// How it was taken.
    pub facts: FrameFacts,
}

/// A camera whose frames can be trusted.
///
/// [`configure`](Self::configure) and [`start`](Self::start) come first; after an error of [`grab_after`](Self::grab_after) it must be
/// started again, after [`CameraError::Gone`] [reconnected](Self::reconnect).
pub trait Camera: Send {
    /// What it is, for records and messages.
    fn identity(&self) -> CameraIdentity;

    /// The present, on the camera's clock.
    fn now(&mut self) -> Moment;

    /// The formats that it offers.
    ///
    /// # Errors
    /// [`CameraError`] if it does not answer.
    fn offered(&mut self) -> Result<Vec<OfferedFormat>, CameraError>;

    /// All its controls.
    ///
    /// # Errors
    /// [`CameraError`] if it does not answer.
    fn controls(&mut self) -> Result<Vec<Control>, CameraError>;

    /// Sets a control, by its name and a value in words or digits, and returns it as it then is.
    ///
    /// # Errors
    /// [`CameraError`] if there is no such control, or it does not take the value.
    fn set_control(&mut self, name: &str, value: &str) -> Result<Control, CameraError>;

    /// Sets everything up, switches off what is automatic, and tells what has been read back.
    ///
    /// # Errors
    /// [`CameraError`] if something is not offered, or the driver takes something else.
    fn configure(&mut self, settings: &CameraSettings) -> Result<Configuration, CameraError>;

    /// Starts taking frames, and returns when the settings have taken effect and the picture is steady.
    ///
    /// # Errors
    /// [`CameraError`] if it is not configured, does not start or does not become steady within its patience.
    fn start(&mut self) -> Result<(), CameraError>;

    /// A frame whose exposure began at or after `moment`. Every call gives another frame.
    ///
    /// # Errors
    /// [`CameraError`] if there was none within the patience of the settings; the camera is stopped then.
    fn grab_after(&mut self, moment: Moment) -> Result<TakenFrame, CameraError>;

    /// Says which stop of the scan the next frame is for, counted from 0. A camera that shows what is there now need not know.
    fn at_stop(&mut self, _index: usize) {}

    /// Whether it shows what is there now, as often as it is asked; `false` for one that gives frames taken long ago.
    fn is_live(&self) -> bool {
        true
    }

    /// Stops taking frames.
    ///
    /// # Errors
    /// [`CameraError`] if the driver refuses.
    fn stop(&mut self) -> Result<(), CameraError>;

    /// Waits for a camera that has gone, sets it up as before and starts it.
    ///
    /// # Errors
    /// [`CameraError::ReconnectTimeout`] if it is not back in time, [`CameraError::AnotherCamera`] if something else is in its place.
    fn reconnect(&mut self, patience: Duration) -> Result<(), CameraError>;
}

impl<C: Camera + ?Sized> Camera for Box<C> {
    fn identity(&self) -> CameraIdentity {
        (**self).identity()
    }

    fn now(&mut self) -> Moment {
        (**self).now()
    }

    fn offered(&mut self) -> Result<Vec<OfferedFormat>, CameraError> {
        (**self).offered()
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        (**self).controls()
    }

    fn set_control(&mut self, name: &str, value: &str) -> Result<Control, CameraError> {
        (**self).set_control(name, value)
    }

    fn configure(&mut self, settings: &CameraSettings) -> Result<Configuration, CameraError> {
        (**self).configure(settings)
    }

    fn start(&mut self) -> Result<(), CameraError> {
        (**self).start()
    }

    fn grab_after(&mut self, moment: Moment) -> Result<TakenFrame, CameraError> {
        (**self).grab_after(moment)
    }

    fn at_stop(&mut self, index: usize) {
        (**self).at_stop(index);
    }

    fn is_live(&self) -> bool {
        (**self).is_live()
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        (**self).stop()
    }

    fn reconnect(&mut self, patience: Duration) -> Result<(), CameraError> {
        (**self).reconnect(patience)
    }
}
