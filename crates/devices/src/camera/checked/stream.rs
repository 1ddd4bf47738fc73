//! The stream of a checked camera, and the selection of its frames.

use std::time::Duration;

use tracing::{debug, trace};

use super::CheckedCamera;
use super::decode::{Damage, decode};
use super::state::Passed;
use crate::camera::device::{FilledBuffer, VideoDevice};
use crate::camera::moment::Moment;
use crate::camera::stillness::Difference;
use crate::camera::timing::Timed;
use crate::camera::{CameraError, FrameFacts, TakenFrame};
use epirig_core::frame::Frame;

/// Number of first frames that are skipped: settings take up to 6 frames to take effect (as seen in USB
/// cameras), and a few more are for the start of the sensor.
const SETTLING: usize = 8;
/// Number of successive pairs of frames that must agree before the picture is steady.
const STEADY_PAIRS: usize = 4;

impl<D: VideoDevice> CheckedCamera<D> {
    /// Skips frames until the picture no longer changes.
    pub(super) fn settle(&mut self, deadline: Moment) -> Result<(), CameraError> {
        let mut passed = Passed::default();
        let (mut frames, mut agreeing) = (0, Vec::new());
        let mut sequences = Vec::new();
        while frames < SETTLING || agreeing.len() < STEADY_PAIRS {
            let Some((frame, buffer, _)) = self.next_good(deadline, &mut passed)? else {
                if agreeing.is_empty() && passed.unsteady > 0 {
                    let why = passed.reason.unwrap_or_default();
                    return Err(CameraError::Unsteady { camera: self.name(), why });
                }
                return Err(self.timeout(&passed));
            };
            frames += 1;
            sequences.push(buffer.sequence);
            match self.compare(&frame) {
                None => {}
                Some(Ok(difference)) => agreeing.push(difference.typical_dn),
                Some(Err(objection)) => {
                    // Receivers without a signal show noise.
                    self.device.check_signal()?;
                    agreeing.clear();
                    passed.unsteady += 1;
                    debug!(sequence = buffer.sequence, reason = objection, "not steady yet");
                    passed.reason = Some(objection);
                }
            }
            if let Some(stream) = &mut self.stream {
                stream.latest = Some((frame, Moment::default()));
            }
        }
        // The median, because settings may have taken effect between the first frames.
        agreeing.sort_by(f64::total_cmp);
        debug!(frames, difference_dn = agreeing.get(agreeing.len() / 2), "the picture is steady");
        if let Some(stream) = &mut self.stream {
            stream.steady_dn = agreeing.get(agreeing.len() / 2).copied();
            // Some drivers leave the number at zero.
            stream.numbered = Some(sequences.windows(2).any(|pair| pair[0] != pair[1]));
        }
        Ok(())
    }

    /// Difference of a frame from the one before it in the stream; an objection in words if it is too large.
    fn compare(&self, frame: &Frame) -> Option<Result<Difference, String>> {
        let stream = self.stream.as_ref()?;
        let (latest, _) = stream.latest.as_ref()?;
        let difference = Difference::between(latest, frame)?;
        if difference.largest_dn == 0.0 && stream.steady_dn.is_some_and(|steady_dn| steady_dn > 0.0) {
            // With noise, no two frames are equal.
            return Some(Err("the driver gave the same frame twice".to_owned()));
        }
        Some(difference.objection(stream.steady_dn).map_or(Ok(difference), Err))
    }

    fn timeout(&self, passed: &Passed) -> CameraError {
        let patience =
            self.configured.as_ref().map_or(Duration::ZERO, |configured| configured.settings.patience);
        let mut why = passed.why();
        if self.woken {
            why += ", also after its stream was started anew; pull its cable and put it back";
        }
        CameraError::Timeout { camera: self.name(), patience, why }
    }

    /// The next valid buffer, of any age; `None` after the deadline.
    pub(super) fn next_good(
        &mut self,
        deadline: Moment,
        passed: &mut Passed,
    ) -> Result<Option<(Frame, FilledBuffer, Timed)>, CameraError> {
        let mut heard = self.device.now();
        loop {
            let now = self.device.now();
            if now >= deadline {
                return Ok(None);
            }
            let layout = self.configured()?.layout;
            let camera = self.name();
            let Some(stream) = &mut self.stream else { return Err(CameraError::NotStarted(camera)) };
            let quiet_at = if self.woken { deadline } else { deadline.min(heard.after(stream.quiet)) };
            let Some(buffer) = self.device.dequeue(quiet_at.since(now))? else {
                let now = self.device.now();
                if !self.woken && now >= quiet_at && now < deadline {
                    self.woken = true;
                    return Err(CameraError::Silent { camera, time: now.since(heard) });
                }
                continue;
            };
            self.woken = false;
            heard = buffer.received;
            if buffer.damaged && buffer.bytes_used == 0 {
                // Given back unfilled, as by `uvcvideo` when the USB endpoint has halted: its number and its
                // time stamp are zero, and mean nothing.
                self.device.requeue(buffer)?;
                passed.damaged += 1;
                debug!("a buffer was given back empty");
                passed.reason = Some("the driver gave a buffer back empty".to_owned());
                stream.latest = None;
                continue;
            }
            let timed = stream.timing.judge(&buffer);
            let sequence = buffer.sequence;
            trace!(
                buffer = buffer.index,
                sequence,
                bytes = buffer.bytes_used,
                stamp_ns = buffer.stamp.as_ns(),
                received_ns = buffer.received.as_ns(),
                flags = buffer.flags,
                "buffer"
            );
            let ahead =
                stream.sequence.replace(buffer.sequence).map(|before| buffer.sequence.wrapping_sub(before));
            let follows = match (ahead, stream.numbered) {
                (Some(0), None) | (_, Some(false)) | (None, _) => 1,
                (Some(ahead), _) => ahead,
            };
            if follows != 1 {
                // Only neighbours are compared, so the former frame is dropped.
                stream.latest = None;
                let missed = follows.saturating_sub(1).min(1 << 16);
                passed.missed = passed.missed.saturating_add(missed);
                debug!(sequence, missed, "the driver has lost frames");
            }
            if !timed.fresh {
                passed.stale += 1;
                stream.latest = None;
                // At every stop these are as many as the move has taken; the next accepted frame reports
                // their number.
                trace!(sequence, reason = "too old", "frame skipped");
                // Whatever is wrong with it, the frame is skipped anyway.
                self.audience.show(|| decode(&mut self.device, &buffer, &layout).ok());
                self.device.requeue(buffer)?;
                continue;
            }
            let decoded = decode(&mut self.device, &buffer, &layout);
            self.device.requeue(buffer)?;
            match decoded {
                Ok(frame) => {
                    self.audience.show_this(&frame);
                    return Ok(Some((frame, buffer, timed)));
                }
                Err(Damage::Frame(reason)) => {
                    passed.damaged += 1;
                    debug!(sequence, reason, "frame skipped");
                    passed.reason = Some(reason);
                    if let Some(stream) = &mut self.stream {
                        stream.latest = None;
                    }
                }
                Err(Damage::Device(error)) => return Err(error),
            }
        }
    }

    /// A frame that began after `moment` and is confirmed by its neighbour.
    pub(super) fn take(
        &mut self,
        moment: Moment,
        deadline: Moment,
        passed: &mut Passed,
    ) -> Result<TakenFrame, CameraError> {
        if let Some(stream) = &mut self.stream {
            stream.timing.ask(moment);
            // A neighbour counts only if it shows the same state of the scene.
            stream.latest.take_if(|(_, began)| *began < moment);
        }
        loop {
            let Some((frame, buffer, timed)) = self.next_good(deadline, passed)? else {
                return Err(self.timeout(passed));
            };
            let compared = self.compare(&frame);
            if let Some(stream) = &mut self.stream {
                stream.latest = Some((frame.clone(), timed.exposure_start));
            }
            match compared {
                None => self.device.next_is_compared(),
                Some(Err(objection)) => {
                    self.device.check_signal()?;
                    passed.unsteady += 1;
                    debug!(sequence = buffer.sequence, reason = objection, "frame skipped");
                    passed.reason = Some(objection);
                }
                Some(Ok(difference)) => {
                    debug!(
                        sequence = buffer.sequence,
                        difference_dn = difference.typical_dn,
                        too_old = passed.stale,
                        "frame accepted"
                    );
                    let facts = FrameFacts {
                        requested: moment,
                        exposure_start: timed.exposure_start,
                        timing: timed.rule,
                        stamp: buffer.stamp,
                        received: buffer.received,
                        sequence: buffer.sequence,
                        flags: buffer.flags,
                        stale: passed.stale,
                        damaged: passed.damaged,
                        missed: passed.missed,
                        unsteady: passed.unsteady,
                        restarts: passed.restarts,
                        difference_dn: Some(difference.typical_dn),
                        controls: Vec::new(),
                    };
                    return Ok(TakenFrame { frame, facts });
                }
            }
        }
    }
}
