//! Earliest possible start of a frame's exposure.
//!
//! A frame counts only if its whole exposure is after a given moment, but drivers differ in the meaning of
//! their time stamps. The rule, for a frame interval T and an exposure time E (T if the camera does not
//! report it):
//!
//! | stamp of the driver | earliest start of the exposure |
//! | --- | --- |
//! | start of exposure | stamp - T - E: `uvcvideo` stamps the first packet, which comes after the exposure, and calls it the start; cameras that compress or buffer send it up to T later |
//! | end of frame | stamp - 2 T - E: the readout takes T at most, and a camera's own memory as much |
//! | none, or an impossible stamp: zero, not increasing, later than T after its arrival, or long before the given moment although the frame count excludes that | counted |
//!
//! In the virtual rig, `uvcvideo` stamped frames of a camera that sends 20 ms after the start of an exposure
//! 20.2 to 25.8 ms after that start, and called it the start.
//!
//! Counted: of the frames that are taken from the queue after the given moment, those in all buffers, and
//! [`IN_FLIGHT`] more, may have begun before it. The next one did not.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::device::{FilledBuffer, StampSource};
use super::moment::Moment;

/// Frames that may have begun but are not yet in the queue: one being exposed, one being read out, one in the
/// camera's own memory or on the cable.
pub const IN_FLIGHT: usize = 3;

/// How the start of an exposure is determined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TimingRule {
    /// From stamps of the start of the exposure.
    StartOfExposure,
    /// From stamps of the end of the frame.
    EndOfFrame,
    /// By counting frames, because the stamps are unusable.
    Counted,
}

/// Timing of a buffer's exposure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Timed {
    pub(super) rule: TimingRule,
    /// Earliest start of the exposure; the requested moment if only counting is possible.
    pub(super) exposure_start: Moment,
    /// Whether the exposure began at or after the requested moment.
    pub(super) fresh: bool,
}

/// Follows the time stamps of a stream.
#[derive(Debug, Clone)]
pub(super) struct Timing {
    interval: Duration,
    exposure: Duration,
    /// Frames that may have begun before a moment and are taken from the queue after it.
    stale_at_most: usize,
    previous: Option<Moment>,
    /// Once a stamp of a stream is wrong, all its stamps are ignored.
    distrusted: bool,
    asked: Moment,
    /// Frames received since the request.
    received: usize,
}

impl Timing {
    /// For a stream with this frame interval and exposure time, which defaults to the interval.
    pub(super) fn new(interval: Duration, exposure: Option<Duration>, buffers: usize) -> Self {
        Self {
            interval,
            exposure: exposure.unwrap_or(interval),
            stale_at_most: buffers + IN_FLIGHT,
            previous: None,
            distrusted: false,
            asked: Moment::default(),
            received: 0,
        }
    }

    /// Requests frames whose exposure began at `moment` or later.
    pub(super) fn ask(&mut self, moment: Moment) {
        if moment != self.asked {
            self.asked = moment;
            self.received = 0;
        }
    }

    /// Determines the timing of the next buffer of the stream.
    pub(super) fn judge(&mut self, buffer: &FilledBuffer) -> Timed {
        self.distrusted |= !self.plausible(buffer);
        self.previous = Some(buffer.stamp);
        self.received += usize::from(buffer.received >= self.asked);
        let counted = self.received > self.stale_at_most;
        let timed = self.by_stamp(buffer);
        // The rules subtract at most four intervals, except for long exposures, which counting covers too.
        // Older stamps must come from another clock.
        self.distrusted |= !timed.fresh && self.received > self.stale_at_most + 4;
        if self.distrusted || timed.rule == TimingRule::Counted {
            let exposure_start = if counted { self.asked } else { Moment::default() };
            return Timed { rule: TimingRule::Counted, exposure_start, fresh: counted };
        }
        timed
    }

    fn by_stamp(&self, buffer: &FilledBuffer) -> Timed {
        // In any case, the frame existed when it was received.
        let stamp = buffer.stamp.min(buffer.received);
        let (rule, exposure_start) = match buffer.stamp_source {
            StampSource::StartOfExposure => {
                (TimingRule::StartOfExposure, stamp.before(self.interval).before(self.exposure))
            }
            StampSource::EndOfFrame => {
                (TimingRule::EndOfFrame, stamp.before(self.interval * 2).before(self.exposure))
            }
            StampSource::Unknown => (TimingRule::Counted, Moment::default()),
        };
        Timed { rule, exposure_start, fresh: exposure_start >= self.asked }
    }

    fn plausible(&self, buffer: &FilledBuffer) -> bool {
        let increasing = self.previous.is_none_or(|previous| previous < buffer.stamp);
        let future = buffer.stamp > buffer.received.after(self.interval);
        increasing && !future && buffer.stamp.as_ns() > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: u64 = 40_000_000;

    fn buffer(stamp: u64, received: u64, stamp_source: StampSource) -> FilledBuffer {
        FilledBuffer {
            index: 0,
            bytes_used: 0,
            stamp: Moment::from_ns(stamp),
            stamp_source,
            sequence: 0,
            flags: 0,
            damaged: false,
            received: Moment::from_ns(received),
        }
    }

    fn timing(exposure_ns: Option<u64>) -> Timing {
        Timing::new(Duration::from_nanos(T), exposure_ns.map(Duration::from_nanos), 4)
    }

    #[test]
    fn stamps_are_read_as_the_table_says() {
        let start = |source, exposure| {
            let timed = timing(exposure).judge(&buffer(10 * T, 10 * T + 5, source));
            (timed.rule, timed.exposure_start.as_ns())
        };
        let ms = 1_000_000;
        assert_eq!(
            start(StampSource::StartOfExposure, Some(8 * ms)),
            (TimingRule::StartOfExposure, 9 * T - 8 * ms)
        );
        assert_eq!(start(StampSource::StartOfExposure, None), (TimingRule::StartOfExposure, 8 * T));
        assert_eq!(start(StampSource::EndOfFrame, Some(8 * ms)), (TimingRule::EndOfFrame, 8 * T - 8 * ms));
        assert_eq!(start(StampSource::EndOfFrame, None), (TimingRule::EndOfFrame, 7 * T));
        assert_eq!(start(StampSource::Unknown, None).0, TimingRule::Counted);
        // An end of frame that is stamped in advance, as by the vivid driver, is of our clock all the same.
        let early = timing(None).judge(&buffer(5 * T + T * 9 / 10, 5 * T, StampSource::EndOfFrame));
        assert_eq!((early.rule, early.exposure_start.as_ns()), (TimingRule::EndOfFrame, 2 * T));
    }

    #[test]
    fn a_stamp_that_cannot_be_ends_the_trust_in_the_stream() {
        let wrong: [&[(u64, u64)]; 4] = [
            // Zero; standing still; running back; another clock, ahead of ours.
            &[(0, 5 * T)],
            &[(4 * T, 5 * T), (4 * T, 6 * T)],
            &[(4 * T, 5 * T), (3 * T, 6 * T)],
            &[(u64::MAX / 2, 5 * T)],
        ];
        for stamps in wrong {
            let mut timing = timing(None);
            let judge = |&(stamp, received): &(u64, u64)| {
                timing.judge(&buffer(stamp, received, StampSource::StartOfExposure)).rule
            };
            assert_eq!(stamps.iter().map(judge).last(), Some(TimingRule::Counted), "{stamps:?}");
            let later = timing.judge(&buffer(9 * T, 9 * T, StampSource::StartOfExposure));
            assert_eq!(later.rule, TimingRule::Counted, "distrust lasts");
        }
    }

    #[test]
    fn counting_lets_all_buffers_and_frames_in_flight_pass() {
        let mut timing = timing(None);
        timing.ask(Moment::from_ns(100 * T));
        // Two that were taken from the queue before the moment do not count.
        let fresh =
            (0..12).map(|index| timing.judge(&buffer(0, (98 + index) * T, StampSource::Unknown)).fresh);
        let first = fresh.collect::<Vec<_>>().iter().position(|fresh| *fresh);
        assert_eq!(first, Some(2 + 4 + IN_FLIGHT));
    }

    #[test]
    fn a_clock_that_is_behind_ours_is_noticed_by_counting() {
        let mut timing = timing(None);
        timing.ask(Moment::from_ns(100 * T));
        let judged: Vec<Timed> = (0..20)
            .map(|index| {
                timing.judge(&buffer((1 + index) * T, (100 + index) * T, StampSource::StartOfExposure))
            })
            .collect();
        let first = judged.iter().position(|timed| timed.fresh).unwrap();
        assert_eq!(first, 4 + IN_FLIGHT + 4);
        assert_eq!(judged[first].rule, TimingRule::Counted);
    }
}
