//! The camera as the rest of the program knows it: frames that can be trusted.

use std::sync::Arc;
use std::time::Duration;

use super::control::Control;
use super::error::CameraError;
use super::format::OfferedFormat;
use super::identity::CameraIdentity;
use super::moment::Moment;
use super::onlooker::Onlooker;
use super::settings::{CameraSettings, Configuration};
use super::timing::TimingRule;
use epirig_core::frame::Frame;

/// How a frame was taken.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameFacts {
    /// The moment after which the exposure had to begin.
    pub requested: Moment,
    /// Earliest possible start of the exposure.
    pub exposure_start: Moment,
    /// How that was determined.
    pub timing: TimingRule,
    /// The driver's own time stamp.
    pub stamp: Moment,
    /// When it was taken from the driver's queue.
    pub received: Moment,
    /// The driver's frame count, which wraps.
    pub sequence: u32,
    /// The driver's flags.
    pub flags: u32,
    /// Frames skipped because they began too early.
    pub stale: usize,
    /// Frames skipped because they were damaged.
    pub damaged: usize,
    /// Frames lost by the driver meanwhile, from its count.
    pub missed: u32,
    /// Frames skipped because they differed from the frame before.
    pub unsteady: usize,
    /// Number of restarts of the stream.
    pub restarts: usize,
    /// Typical difference from the frame before, in DN, which is the noise of a difference. `None` without
    /// such a frame.
    pub difference_dn: Option<f64>,
    /// The watched controls and their values, read back after the frame was taken.
    pub controls: Vec<(String, i64)>,
}

/// A frame, and how it was taken.
#[derive(Debug, Clone, PartialEq)]
pub struct TakenFrame {
    /// The image.
    pub frame: Frame,
    /// How it was taken.
    pub facts: FrameFacts,
}

/// A camera with checked frames.
///
/// Call [`configure`](Self::configure) and [`start`](Self::start) first. After an error of
/// [`grab_after`](Self::grab_after) it must be started again; after [`CameraError::Gone`] it must be
/// [reconnected](Self::reconnect).
pub trait Camera: Send {
    /// Identity, for records and messages.
    fn identity(&self) -> CameraIdentity;

    /// The present time on the camera's clock.
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

    /// Sets a control by its name, to a name or a number, and returns its new state.
    ///
    /// # Errors
    /// [`CameraError`] if there is no such control, or it refuses the value.
    fn set_control(&mut self, name: &str, value: &str) -> Result<Control, CameraError>;

    /// Configures the camera, switches off automatic controls, and returns the values that were read back.
    ///
    /// # Errors
    /// [`CameraError`] if something is not offered, or the driver sets something else.
    fn configure(&mut self, settings: &CameraSettings) -> Result<Configuration, CameraError>;

    /// Starts the stream, and returns when the settings have taken effect and the picture is steady.
    ///
    /// # Errors
    /// [`CameraError`] if it is not configured, does not start, or is not steady before the time-out.
    fn start(&mut self) -> Result<(), CameraError>;

    /// A frame whose exposure began at or after `moment`. Every call gives another frame.
    ///
    /// # Errors
    /// [`CameraError`] if there was none before the time-out of the settings; the camera is stopped then.
    fn grab_after(&mut self, moment: Moment) -> Result<TakenFrame, CameraError>;

    /// The newest picture as it comes, for a person's eyes: it is not checked for age, steadiness or
    /// neighbours. `None` if no picture came within `patience`, which should be a few frame times. Damaged
    /// pictures are skipped.
    ///
    /// The stream is started if it does not run, without waiting for a steady picture. Controls that are set
    /// meanwhile show in later pictures. A look ends the checked stream: [`start`](Self::start) begins it
    /// again, and until then [`grab_after`](Self::grab_after) gives [`CameraError::NotStarted`].
    /// [`stop`](Self::stop), [`configure`](Self::configure) and [`reconnect`](Self::reconnect) end the look.
    /// A replay gives the frame of the present stop.
    ///
    /// # Errors
    /// [`CameraError`] if it is not configured, or the stream breaks down; the camera is stopped then.
    fn look(&mut self, patience: Duration) -> Result<Option<Frame>, CameraError>;

    /// Shows all good pictures that the camera receives while it takes frames to `onlooker`, also those that
    /// it skips as too old or unsteady. `None` ends that. By default nothing is shown.
    fn show_to(&mut self, _onlooker: Option<Arc<dyn Onlooker>>) {}

    /// Shows pictures to the onlooker for `time`, while the stage moves: none of them is kept. The stream goes
    /// on as it was. By default, and without a stream, it only waits.
    ///
    /// # Errors
    /// [`CameraError`] if the stream breaks down; the next grab will find that out, too.
    fn show_for(&mut self, time: Duration) -> Result<(), CameraError> {
        std::thread::sleep(time);
        Ok(())
    }

    /// Announces the stop of the scan for the next frame, counted from 0. Only a replay needs it.
    fn at_stop(&mut self, _index: usize) {}

    /// Whether it shows the present view; `false` for a replay.
    fn is_live(&self) -> bool {
        true
    }

    /// Stops taking frames.
    ///
    /// # Errors
    /// [`CameraError`] if the driver refuses.
    fn stop(&mut self) -> Result<(), CameraError>;

    /// Waits for a disconnected camera, configures it as before and starts it.
    ///
    /// # Errors
    /// [`CameraError::ReconnectTimeout`] if it does not return in time, [`CameraError::AnotherCamera`] if
    /// another camera is in its place, [`CameraError::AnotherSocket`] if it may be another one.
    fn reconnect(&mut self, patience: Duration) -> Result<(), CameraError>;
}
