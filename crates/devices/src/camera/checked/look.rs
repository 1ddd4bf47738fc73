//! The newest picture as it comes, for a person's eyes.

use std::time::Duration;

use tracing::debug;

use super::CheckedCamera;
use super::decode::{Damage, decode};
use crate::camera::CameraError;
use crate::camera::device::{FilledBuffer, VideoDevice};
use crate::camera::moment::Moment;
use epirig_core::frame::Frame;

impl<D: VideoDevice> CheckedCamera<D> {
    /// The newest picture until `deadline`, of a stream that is started if it does not run.
    pub(super) fn newest_picture(&mut self, deadline: Moment) -> Result<Option<Frame>, CameraError> {
        let layout = self.configured()?.layout;
        let buffers = self.begin_look()?;
        let mut waiting = self.newest_waiting(buffers)?;
        loop {
            let buffer = match waiting.take() {
                Some(buffer) => buffer,
                None => {
                    let patience = deadline.since(self.device.now());
                    match self.device.dequeue(patience)? {
                        Some(buffer) => buffer,
                        None if self.device.now() < deadline => continue,
                        None => return Ok(None),
                    }
                }
            };
            let decoded = decode(&mut self.device, &buffer, &layout);
            self.device.requeue(buffer)?;
            match decoded {
                Ok(frame) => {
                    // Receivers without a signal show noise.
                    self.device.check_signal()?;
                    return Ok(Some(frame));
                }
                Err(Damage::Frame(reason)) => debug!(sequence = buffer.sequence, reason, "picture skipped"),
                Err(Damage::Device(error)) => return Err(error),
            }
            if self.device.now() >= deadline {
                return Ok(None);
            }
        }
    }

    /// Makes sure that the device streams for a look, and returns its number of buffers.
    fn begin_look(&mut self) -> Result<usize, CameraError> {
        if let Some(buffers) = self.look_buffers {
            return Ok(buffers);
        }
        let buffers = match self.stream.take() {
            // The look takes over what streams already.
            Some(stream) => stream.buffers,
            None => self.start_device()?,
        };
        self.look_buffers = Some(buffers);
        Ok(buffers)
    }

    /// The newest of the buffers that wait now.
    fn newest_waiting(&mut self, buffers: usize) -> Result<Option<FilledBuffer>, CameraError> {
        let mut newest = None;
        for _ in 0..buffers {
            let Some(buffer) = self.device.dequeue(Duration::ZERO)? else { return Ok(newest) };
            if let Some(older) = newest.replace(buffer) {
                self.device.requeue(older)?;
            }
        }
        // All buffers were full, so the driver had no room for newer pictures: these are of any age.
        if let Some(old) = newest {
            self.device.requeue(old)?;
        }
        Ok(None)
    }
}
