//! The interface of a bare camera driver: buffers as received, with all their faults.

use std::time::Duration;

use super::CameraError;
use super::control::Control;
use super::format::{ActiveFormat, Interval, OfferedFormat, Size};
use super::identity::CameraIdentity;
use super::moment::Moment;
use super::pixels::FourCc;

/// The driver's statement about its time stamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StampSource {
    /// Monotonic clock; time of the start of the exposure.
    StartOfExposure,
    /// Monotonic clock; time of the arrival of the last pixel.
    EndOfFrame,
    /// Anything.
    Unknown,
}

/// A filled buffer of a driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FilledBuffer {
    /// Number of the buffer.
    pub index: usize,
    /// Number of valid bytes.
    pub bytes_used: usize,
    /// The driver's time stamp.
    pub stamp: Moment,
    /// Meaning of the stamp, according to the driver.
    pub stamp_source: StampSource,
    /// The driver's frame count, which wraps.
    pub sequence: u32,
    /// The driver's flags, as they are.
    pub flags: u32,
    /// Whether the driver says that the contents are damaged.
    pub damaged: bool,
    /// When it was taken from the driver's queue.
    pub received: Moment,
}

/// A video device as its driver presents it: it substitutes, clamps, drops, damages and goes away without
/// asking.
///
/// [`CheckedCamera`](super::CheckedCamera) makes a camera of it that can be trusted. Implementations judge
/// nothing, and return within the times that they are given.
pub trait VideoDevice: Send {
    /// What it is.
    fn identity(&self) -> CameraIdentity;

    /// The present, on the clock of the time stamps.
    fn now(&mut self) -> Moment;

    /// Lets time pass.
    fn pause(&mut self, time: Duration);

    /// A first frame that is late enough has come; the next one is compared with it. Simulated devices let planned
    /// faults happen to that one: faults of frames that are too old would have no effect.
    fn next_is_compared(&mut self) {}

    /// The formats that it offers.
    ///
    /// # Errors
    /// [`CameraError`] if it does not answer.
    fn offered(&mut self) -> Result<Vec<OfferedFormat>, CameraError>;

    /// What it is set to.
    ///
    /// # Errors
    /// [`CameraError`] if it does not answer.
    fn active_format(&mut self) -> Result<ActiveFormat, CameraError>;

    /// Asks for a format and returns what the driver took instead.
    ///
    /// # Errors
    /// [`CameraError`] if it does not answer, or streams.
    fn set_format(&mut self, four_cc: FourCc, size: Size) -> Result<ActiveFormat, CameraError>;

    /// Time from frame to frame, if the driver knows it.
    ///
    /// # Errors
    /// [`CameraError`] if it does not answer.
    fn interval(&mut self) -> Result<Option<Interval>, CameraError>;

    /// Asks for a rate; what the driver made of it, [`interval`](Self::interval) tells.
    ///
    /// # Errors
    /// [`CameraError`] if it has no choice of rates.
    fn set_interval(&mut self, interval: Interval) -> Result<(), CameraError>;

    /// All controls with their values.
    ///
    /// # Errors
    /// [`CameraError`] if it does not answer.
    fn controls(&mut self) -> Result<Vec<Control>, CameraError>;

    /// The value of a control.
    ///
    /// # Errors
    /// [`CameraError`] if it cannot be read.
    fn read_control(&mut self, id: u32) -> Result<i64, CameraError>;

    /// The values of several controls, as soon after each other as the driver can.
    ///
    /// # Errors
    /// [`CameraError`] if one of them cannot be read.
    fn read_controls(&mut self, ids: &[u32]) -> Result<Vec<i64>, CameraError> {
        ids.iter().map(|id| self.read_control(*id)).collect()
    }

    /// Sets a control; the driver may clamp silently.
    ///
    /// # Errors
    /// [`CameraError`] if it refuses.
    fn write_control(&mut self, id: u32, value: i64) -> Result<(), CameraError>;

    /// Whether what the device looks at is there: a video signal that is what the device is set for.
    ///
    /// # Errors
    /// [`CameraError::NoSignal`].
    fn check_signal(&mut self) -> Result<(), CameraError>;

    /// Makes buffers, queues all of them and starts; returns how many the driver has made.
    ///
    /// # Errors
    /// [`CameraError`] if the driver refuses; the device does not stream then.
    fn start(&mut self, buffers: usize) -> Result<usize, CameraError>;

    /// Stops and gives the buffers back. A device that does not stream stays as it is.
    ///
    /// # Errors
    /// [`CameraError`] if the driver refuses.
    fn stop(&mut self) -> Result<(), CameraError>;

    /// The next filled buffer, within `patience`; `None` if there was none.
    ///
    /// # Errors
    /// [`CameraError`] if the stream has broken down.
    fn dequeue(&mut self, patience: Duration) -> Result<Option<FilledBuffer>, CameraError>;

    /// The bytes of a buffer that was dequeued and not yet queued again, cut to those that count.
    ///
    /// # Errors
    /// [`CameraError`] if the buffer is not there.
    fn bytes(&mut self, buffer: &FilledBuffer) -> Result<&[u8], CameraError>;

    /// Gives a buffer back to be filled.
    ///
    /// # Errors
    /// [`CameraError`] if the driver does not take it.
    fn requeue(&mut self, buffer: FilledBuffer) -> Result<(), CameraError>;

    /// Lets go of a device that has gone: while anybody holds it, it cannot come back under its name.
    fn let_go(&mut self);

    /// Opens the device anew after it has gone, and makes sure that it is the same one.
    ///
    /// # Errors
    /// [`CameraError`] if it is not back yet, or another one is in its place.
    fn reopen(&mut self) -> Result<(), CameraError>;
}
