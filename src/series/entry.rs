//! What is known of one sequence, from its records alone: no frame and no map is read.

use std::path::Path;

use serde::Serialize;

use crate::calibrate::has_calibration;
use crate::results::{ResultsError, ResultsKind, SurfaceFacts, read_surface_facts, record_hash};
use epirig_core::fault::Fault as _;
use epirig_data::sequence::{ExitStatus, Origin, Sequence};
use epirig_surface::conformity::Verdict;

epirig_core::choices! {
    /// How far the work on a sequence has come.
    pub enum SequenceState {
        /// Its records cannot be read.
        Unreadable = "unreadable",
        /// It has frames.
        Scan = "scan",
        /// It has a calibration.
        Calibrated = "calibrated",
        /// It has results of `match`.
        Matched = "matched",
        /// Its surface was measured.
        Measured = "measured",
    }
}

/// A sequence of a series.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SeriesEntry {
    /// Its folder, as seen from the folder that was listed; `.` for that itself.
    pub name: String,
    /// When it was begun, as in RFC 3339; empty if that cannot be read.
    pub created: String,
    /// How far the work has come.
    pub state: SequenceState,
    /// How the scan ended, as in `match.json`; `unfinished` if it has not.
    pub ended: &'static str,
    /// Frames that are there.
    pub frames: usize,
    /// Frames that are planned.
    pub planned: usize,
    /// Depth of the hollows, or height of the raised parts, in mm; `None` if it was not measured.
    pub depth_mm: Option<f64>,
    /// Half the width of its interval of 95 % coverage, in mm; `None` if that is not known.
    pub half_width_95_mm: Option<f64>,
    /// The verdict about the surface; `None` without limits.
    pub verdict: Option<Verdict>,
    /// Whether the scan has ended early and can be continued.
    pub can_be_resumed: bool,
    /// Hash of the record of its results, which tells them from others; `None` if it has none.
    #[serde(skip)]
    pub matched_blake3: Option<String>,
    /// Why something is not told, or must not be trusted: in words, with what to do.
    pub problem: Option<String>,
}

impl SeriesEntry {
    /// Of the sequence in `folder`, which is called `name`.
    pub fn of(folder: &Path, name: String) -> Self {
        let unknown = Self {
            name,
            created: String::new(),
            state: SequenceState::Unreadable,
            ended: "",
            frames: 0,
            planned: 0,
            depth_mm: None,
            half_width_95_mm: None,
            verdict: None,
            can_be_resumed: false,
            matched_blake3: None,
            problem: None,
        };
        let sequence = match Sequence::open(folder) {
            Ok(sequence) => sequence,
            Err(error) => return Self { problem: Some(error.message()), ..unknown },
        };
        let record = sequence.record();
        let was_captured = matches!(record.origin, Origin::Captured { .. });
        let has_ended = sequence.stop().map(|stop| stop.exit_status);
        let known = Self {
            created: record.created.clone(),
            ended: sequence.ended(),
            frames: sequence.frames().len(),
            planned: record.frames,
            can_be_resumed: was_captured
                && !matches!(has_ended, Some(ExitStatus::Complete | ExitStatus::NotClosed)),
            ..unknown
        };
        let results = folder.join("results");
        let scanned = match has_calibration(folder) {
            true => SequenceState::Calibrated,
            false => SequenceState::Scan,
        };
        let Ok(matched_blake3) = record_hash(&results, ResultsKind::Match) else {
            return Self { state: scanned, ..known };
        };
        let matched =
            Self { state: SequenceState::Matched, matched_blake3: Some(matched_blake3.clone()), ..known };
        match read_surface_facts(&results.join("surface")) {
            Ok(facts) => matched.with_surface(&facts, (&record.uid, &matched_blake3)),
            Err(error) if error.is_missing() => matched,
            Err(error) => Self { problem: Some(told(&error)), ..matched },
        }
    }

    /// With what was measured of its surface, if that is made of the results that are there.
    fn with_surface(self, facts: &SurfaceFacts, (uid, matched_blake3): (&str, &str)) -> Self {
        if facts.sequence_uid != *uid || facts.matched_blake3 != *matched_blake3 {
            let problem =
                "its surface was measured from other results; repeat `epirig surface` with --overwrite";
            return Self { problem: Some(problem.to_owned()), ..self };
        }
        Self {
            state: SequenceState::Measured,
            depth_mm: facts.depth_mm(),
            half_width_95_mm: facts.half_width_95_mm(),
            verdict: facts.conclusion.verdict,
            ..self
        }
    }
}

fn told(error: &ResultsError) -> String {
    format!("{}; repeat `epirig surface` with --overwrite", error.message())
}
