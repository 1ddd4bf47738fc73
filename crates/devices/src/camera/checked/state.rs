//! State of a running stream, and of a wait for a good frame.

use std::time::Duration;

use crate::camera::moment::Moment;
use crate::camera::timing::Timing;
use epirig_core::frame::Frame;

/// State of a running stream.
#[derive(Debug)]
pub(super) struct Stream {
    pub(super) timing: Timing,
    /// Number of buffers that the driver has made.
    pub(super) buffers: usize,
    /// Time without any buffer after which the stream is taken for broken.
    pub(super) quiet: Duration,
    /// The latest sequence number.
    pub(super) sequence: Option<u32>,
    /// Whether the driver numbers its frames; `None` if not known yet.
    pub(super) numbered: Option<bool>,
    /// Typical difference of two frames of a steady picture, in DN.
    pub(super) steady_dn: Option<f64>,
    /// The latest good frame, with the start of its exposure.
    pub(super) latest: Option<(Frame, Moment)>,
}

impl Stream {
    /// The state of a stream that has just started.
    pub(super) fn new(timing: Timing, buffers: usize, quiet: Duration) -> Self {
        Self { timing, buffers, quiet, sequence: None, numbered: None, steady_dn: None, latest: None }
    }
}

/// Rejected frames while waiting for a good one.
#[derive(Debug, Default)]
pub(super) struct Passed {
    pub(super) stale: usize,
    pub(super) damaged: usize,
    pub(super) missed: u32,
    pub(super) unsteady: usize,
    pub(super) restarts: usize,
    pub(super) reason: Option<String>,
}

impl Passed {
    pub(super) fn why(&self) -> String {
        let counts = [
            (self.stale, "too old"),
            (self.damaged, "damaged"),
            (self.missed as usize, "lost by the driver"),
            (self.unsteady, "unlike the frame before"),
        ];
        let seen: Vec<String> = counts
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
        let seen = if seen.is_empty() { "no frame was received".to_owned() } else { seen.join(", ") };
        self.reason.as_ref().map_or(seen.clone(), |reason| format!("{seen} (last: {reason})"))
    }
}
