//! What the page is told of a scan.

use serde::Serialize;

/// How a scan is going.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub(in crate::panel) enum ScanPhase {
    /// Frames are taken.
    #[default]
    Running,
    /// It ends after the frame in hand.
    Pausing,
    /// It can be resumed.
    Paused,
    /// All frames are there.
    Done,
    /// It cannot be resumed.
    Failed,
}

/// A scan.
#[derive(Debug, Clone, Default, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct ScanState {
    /// Name of the folder.
    pub(in crate::panel) name: String,
    /// Its whole path.
    pub(in crate::panel) folder: String,
    /// How it is going.
    pub(in crate::panel) state: ScanPhase,
    /// Who holds it: `operator`, `camera`, `stage`, `disk`.
    pub(in crate::panel) held_by: Vec<&'static str>,
    /// Why it was paused, or failed.
    pub(in crate::panel) reason: Option<String>,
    /// Frames of the plan.
    pub(in crate::panel) planned: usize,
    /// Frames that are there.
    pub(in crate::panel) done: usize,
    /// Attempts that failed.
    pub(in crate::panel) retakes: Vec<Retake>,
    /// The frames of this run.
    pub(in crate::panel) stops: Vec<Stop>,
    /// What a person is asked to put before the camera.
    pub(in crate::panel) asked: Option<Asked>,
    /// Time left, in s; negative if it is over.
    pub(in crate::panel) seconds_left: Option<f64>,
    /// Bytes still to be written, without compression.
    pub(in crate::panel) needs_bytes: Option<u64>,
    /// Free space on the disk, in bytes.
    pub(in crate::panel) free_bytes: Option<u64>,
    /// The latest live map.
    pub(in crate::panel) map: Option<LiveMapState>,
    /// Frames and median sigma, in px, of the live maps: one for each number of frames, in their order.
    pub(in crate::panel) course: Vec<(usize, f64)>,
    /// Whether there are results.
    pub(in crate::panel) measured: bool,
}

impl ScanState {
    /// A scan that begins now.
    pub(in crate::panel) fn begun(name: &str, folder: String, planned: usize, done: usize) -> Self {
        Self { name: name.to_owned(), folder, planned, done, ..Self::default() }
    }

    /// A live map of so many frames has this median sigma, in px. After a pause maps begin with few frames again.
    pub(in crate::panel) fn has_sigma(&mut self, frames: usize, sigma_px: f64) {
        match self.course.binary_search_by_key(&frames, |known| known.0) {
            Ok(place) => self.course[place].1 = sigma_px,
            Err(place) => self.course.insert(place, (frames, sigma_px)),
        }
    }

    /// A pause was asked for.
    pub(in crate::panel) fn pausing(&mut self) {
        if self.state == ScanPhase::Running {
            self.state = ScanPhase::Pausing;
        }
    }
}

/// An attempt that failed.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct Retake {
    /// Index of the frame.
    pub(in crate::panel) index: usize,
    /// Number of the attempt, from 1.
    pub(in crate::panel) attempt: usize,
    /// Why.
    pub(in crate::panel) reason: String,
}

/// A frame of the scan.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct Stop {
    /// Its index.
    pub(in crate::panel) index: usize,
    /// Attempts that it took.
    pub(in crate::panel) attempts: usize,
    /// Planned position, in mm.
    pub(in crate::panel) planned_mm: f64,
    /// Reported position, in mm.
    pub(in crate::panel) reported_mm: f64,
    /// Share of saturated samples, 0 to 1.
    pub(in crate::panel) saturated: f64,
    /// Mean, in DN.
    pub(in crate::panel) mean_dn: f64,
    /// Time since the scan began, in s.
    pub(in crate::panel) at_s: f64,
}

/// What a person is asked to put before the camera.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct Asked {
    /// `object`, `dark`, `flat` or `board`.
    #[cfg_attr(test, ts(type = "'object' | 'dark' | 'flat' | 'board'"))]
    pub(in crate::panel) kind: &'static str,
    /// An instruction.
    pub(in crate::panel) words: String,
    /// Number of the pose, from 1.
    pub(in crate::panel) pose: Option<usize>,
    /// Number of poses.
    pub(in crate::panel) poses: Option<usize>,
    /// Whether the shot is taken by itself.
    pub(in crate::panel) by_itself: bool,
    /// Why it was not taken yet.
    pub(in crate::panel) waiting_for: Option<String>,
}

/// The latest live map.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct LiveMapState {
    /// Counts the maps.
    pub(in crate::panel) number: u64,
    /// Frames that it was made of.
    pub(in crate::panel) frames: usize,
    /// Median sigma, in px.
    pub(in crate::panel) sigma_px: f64,
    /// The same as a height, in mm.
    pub(in crate::panel) sigma_mm: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_course_of_sigma_does_not_run_back_after_a_pause() {
        let mut scan = ScanState::begun("scan-001", String::new(), 40, 0);
        for (frames, sigma_px) in [(5, 0.4), (12, 0.2), (19, 0.1)] {
            scan.has_sigma(frames, sigma_px);
        }
        // The frames before the pause are read again.
        for (frames, sigma_px) in [(3, 0.6), (12, 0.21), (19, 0.1), (25, 0.08)] {
            scan.has_sigma(frames, sigma_px);
        }
        assert_eq!(scan.course, [(3, 0.6), (5, 0.4), (12, 0.21), (19, 0.1), (25, 0.08)]);
    }
}
