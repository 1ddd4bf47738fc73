//! Checking that a sequence is what its records say.

use std::collections::BTreeSet;
use std::io::ErrorKind;

use serde::Serialize;

use super::record::{ExitStatus, FrameKind, FrameRecord};
use super::{Sequence, SequenceError};
use crate::progress::Progress;

/// Something that is not as recorded, with the file it concerns and what to do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// The file, or the sequence's folder.
    pub file: String,
    /// What is wrong and what to do.
    pub problem: String,
}

/// The outcome of a check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct VerifyReport {
    /// Frames whose hash, size and format are as recorded.
    pub good_frames: usize,
    /// Frames planned.
    pub planned_frames: usize,
    /// What is not as recorded; empty for a sound sequence.
    pub findings: Vec<Finding>,
}

/// Reads every frame and compares it with the records: hashes, sizes, formats, gaps, positions, stray files.
///
/// # Errors
/// [`SequenceError`] only if the frames' folder cannot be listed; what is wrong with the sequence is in the report.
pub fn verify(sequence: &Sequence, progress: &dyn Progress) -> Result<VerifyReport, SequenceError> {
    let record = sequence.record();
    let mut findings = Vec::new();
    let mut find = |file: String, problem: String| findings.push(Finding { file, problem });
    let mut good_frames = 0;
    let others: Vec<FrameRecord> =
        FrameKind::CALIBRATION.into_iter().flat_map(|kind| sequence.calibration_frames(kind)).collect();
    progress.begin("checking frames", (sequence.frames().len() + others.len()) as u64);
    for frame in sequence.frames() {
        match sequence.read(frame) {
            Ok(_) => good_frames += 1,
            Err(error) => find(frame.file.clone(), error.to_string()),
        }
        progress.advance(1);
    }
    for frame in &others {
        if let Err(error) = sequence.read(frame) {
            find(frame.file.clone(), error.to_string());
        }
        progress.advance(1);
    }
    progress.end();

    let indices: BTreeSet<usize> = sequence.frames().iter().map(|frame| frame.index).collect();
    let missing: Vec<usize> = (0..record.frames).filter(|index| !indices.contains(index)).collect();
    for gap in missing.chunk_by(|a, b| a + 1 == *b) {
        let problem =
            "not in the journal; `epirig resume` takes what is missing, or use the sequence without"
                .to_owned();
        match gap {
            [one] => find(format!("frame {one}"), problem),
            _ => find(format!("frames {} to {}", gap[0], gap[gap.len() - 1]), problem),
        }
    }
    for frame in sequence.frames() {
        let planned = record.positions_mm.as_ref().and_then(|positions| positions.get(frame.index));
        if frame.index >= record.frames {
            find(
                format!("frame {}", frame.index),
                "not in the plan; restore sequence.json from a copy".to_owned(),
            );
        } else if record.positions_mm.is_some() && frame.commanded_mm.as_ref() != planned {
            let problem = "its position is not the planned one; restore the records from a copy".to_owned();
            find(format!("frame {}", frame.index), problem);
        }
    }
    if indices.len() < sequence.frames().len() {
        find(
            "journal.jsonl".to_owned(),
            "a frame is named twice; restore the journal from a copy".to_owned(),
        );
    }
    if let Err(error) = sequence.tau() {
        find("journal.jsonl".to_owned(), error.to_string());
    }
    match sequence.stop() {
        None => find("stop.json".to_owned(), "missing: the scan has not ended".to_owned()),
        Some(stop) if stop.exit_status == ExitStatus::NotClosed => {
            let problem = "the rig did not stay as it was, so positions are wrong; take the scan again";
            find("stop.json".to_owned(), problem.to_owned());
        }
        Some(stop) if stop.exit_status != ExitStatus::Complete => {
            let reason = stop.reason.as_ref().map_or(String::new(), |reason| format!(": {reason}"));
            find("stop.json".to_owned(), format!("the scan ended before it was complete{reason}"));
        }
        Some(stop) if stop.frames != sequence.frames().len() => {
            let problem = format!("counts {} frames, the journal {}", stop.frames, sequence.frames().len());
            find("stop.json".to_owned(), problem);
        }
        Some(_) => {}
    }
    let named: BTreeSet<_> =
        sequence.frames().iter().chain(&others).map(|frame| sequence.path(frame)).collect();
    let kinds = std::iter::once(FrameKind::Scan).chain(FrameKind::CALIBRATION);
    for name in kinds.map(FrameKind::folder) {
        let folder = sequence.folder().join(name);
        let entries = match std::fs::read_dir(&folder) {
            // Calibration frames are optional.
            Err(error) if error.kind() == ErrorKind::NotFound && name != FrameKind::Scan.folder() => continue,
            Err(error) => {
                find(name.to_owned(), format!("cannot be listed: {error}; restore it from a copy"));
                continue;
            }
            Ok(entries) => entries,
        };
        for entry in entries {
            let path = entry.map_err(SequenceError::io("look into", &folder))?.path();
            if !named.contains(&path) {
                let problem = "no journal line names this file; move it away".to_owned();
                find(path.display().to_string(), problem);
            }
        }
    }
    Ok(VerifyReport { good_frames, planned_frames: record.frames, findings })
}
