//! Verification: whether a sequence is what its records say.

use std::collections::BTreeSet;
use std::io::ErrorKind;

use serde::Serialize;

use super::finding::Finding;
use super::reader::STOP;
use super::record::{ExitStatus, FrameKind, FrameRecord, Origin};
use super::{Sequence, SequenceError};
use crate::storage::is_of_the_system;
use epirig_core::choice::names;
use epirig_core::progress::Progress;

/// The outcome of a check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct VerifyReport {
    /// Frames whose hash, size, format and contents are as recorded.
    pub good_frames: usize,
    /// Frames planned.
    pub planned_frames: usize,
    /// Contradictions to the records; empty for a sound sequence.
    pub findings: Vec<Finding>,
}

/// Reads every frame and compares everything that is recorded twice: hashes, sizes, formats, brightness,
/// gaps, positions, stray files.
///
/// # Errors
/// [`SequenceError`] only if the frames' folder cannot be listed, or the work is cancelled; what is wrong with the sequence is in the
/// report.
pub fn verify(sequence: &Sequence, progress: &dyn Progress) -> Result<VerifyReport, SequenceError> {
    let record = sequence.record();
    let mut findings = Vec::new();
    let mut good_frames = 0;
    let others: Vec<FrameRecord> =
        FrameKind::CALIBRATION.into_iter().flat_map(|kind| sequence.calibration_frames(kind)).collect();
    progress.begin("checking frames", (sequence.frames().len() + others.len()) as u64);
    for (place, frame) in sequence.frames().iter().chain(&others).enumerate() {
        progress.unless_cancelled()?;
        match sequence.read(frame) {
            Ok(_) if place < sequence.frames().len() => good_frames += 1,
            Ok(_) => {}
            Err(error) => findings.push(Finding::new(&frame.file, error.to_string())),
        }
        progress.advance(1);
    }
    progress.end();
    findings.extend(gaps(sequence));
    findings.extend(sequence.contradictions());
    findings.extend(end(sequence));
    findings.extend(stray_files(sequence, &others)?);
    Ok(VerifyReport { good_frames, planned_frames: record.frames, findings })
}

/// Frames of the plan that the journal does not name, neighbours together.
fn gaps(sequence: &Sequence) -> Vec<Finding> {
    let indices: BTreeSet<usize> = sequence.frames().iter().map(|frame| frame.index).collect();
    let missing: Vec<usize> =
        (0..sequence.record().frames).filter(|index| !indices.contains(index)).collect();
    let problem = match sequence.record().origin {
        Origin::Captured { .. } => {
            "not in the journal; `epirig resume` takes what is missing, or use the sequence without"
        }
        _ => "not in the journal; make the sequence again, or use it without",
    };
    let gaps = missing.chunk_by(|a, b| a + 1 == *b);
    gaps.map(|gap| match gap {
        [one] => Finding::new(format!("frame {one}"), problem),
        _ => Finding::new(format!("frames {} to {}", gap[0], gap[gap.len() - 1]), problem),
    })
    .collect()
}

/// A finding about its end.
fn end(sequence: &Sequence) -> Option<Finding> {
    let Some(stop) = sequence.stop() else {
        return Some(Finding::new(STOP, "missing: the scan has not ended"));
    };
    let problem = match stop.exit_status {
        ExitStatus::Complete => return None,
        ExitStatus::NotClosed => {
            "the rig did not stay as it was, so positions are wrong; take the scan again".to_owned()
        }
        ExitStatus::Aborted | ExitStatus::Failed => {
            let reason = stop.reason.as_ref().map_or(String::new(), |reason| format!(": {reason}"));
            format!("the scan ended before it was complete{reason}")
        }
    };
    Some(Finding::new(STOP, problem))
}

/// Files among the frames that no line of the journal names.
fn stray_files(sequence: &Sequence, others: &[FrameRecord]) -> Result<Vec<Finding>, SequenceError> {
    let mut findings = Vec::new();
    let named: BTreeSet<_> =
        sequence.frames().iter().chain(others).map(|frame| sequence.path(frame)).collect();
    for name in names::<FrameKind>() {
        let folder = sequence.folder().join(name);
        let entries = match std::fs::read_dir(&folder) {
            // Calibration frames are optional.
            Err(error) if error.kind() == ErrorKind::NotFound && name != FrameKind::Scan.folder() => continue,
            Err(error) => {
                findings
                    .push(Finding::new(name, format!("cannot be listed: {error}; restore it from a copy")));
                continue;
            }
            Ok(entries) => entries,
        };
        for entry in entries {
            let path = entry.map_err(SequenceError::io("look into", &folder))?.path();
            let is_note = path.file_name().is_some_and(is_of_the_system);
            if !named.contains(&path) && !is_note {
                let problem = "no journal line names this file; move it away";
                findings.push(Finding::new(path.display().to_string(), problem));
            }
        }
    }
    Ok(findings)
}
