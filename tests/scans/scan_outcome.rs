//! What comes of a scan, in words that are made of its result and its records.

#![allow(unreachable_pub, reason = "a module of test programs has no outside")]

use std::fmt::Debug;
use std::path::Path;

use epirig::capture::CaptureError;
use epirig_core::progress::Silent;
use epirig_data::sequence::{ClosureRecord, Event, FrameRecord, Sequence, verify};
use epirig_simulator::Simulator;

pub type ScanResult = Result<Option<ClosureRecord>, CaptureError>;

/// Whether anybody can know at once of what goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Noticed {
    AtOnce,
    /// A stage loses steps and does not know: frames may be wrong until the scan is closed.
    NotAtOnce,
}

/// Lets a scan fail, and resumes it if it can be resumed; what comes of it, in words.
///
/// # Panics
/// If a scan passes for complete and is not whole and right, at once or once it is resumed; if the journal names a wrong frame, but for
/// faults that cannot be known at once; if a scan that has stopped cannot be resumed, but for those, too.
pub fn outcome(
    fault: &str,
    noticed: Noticed,
    simulator: &Simulator,
    positions_mm: &[f64],
    scan: impl FnOnce(&Path) -> ScanResult,
    resume: impl FnOnce(&Path) -> ScanResult,
) -> String {
    println!("{fault}");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("seq");
    let first = scan(&out);
    let (words, wrong) = judge(simulator, positions_mm, &out, &first);
    assert!(wrong == 0 || noticed == Noticed::NotAtOnce, "{fault}: {wrong} WRONG FRAMES in the journal");
    let words = words + &attempts(&out);
    if first.is_ok() {
        return words;
    }
    let second = resume(&out);
    let (then, wrong) = judge(simulator, positions_mm, &out, &second);
    assert!(
        second.is_ok() == (wrong == 0),
        "{fault}: resumed it has {wrong} wrong frames, and ends with: {then}"
    );
    format!("{words}; resumed: {then}")
}

/// How a scan ended, in words, and how many frames of those that the journal names do not show what their positions say.
fn judge(simulator: &Simulator, positions_mm: &[f64], out: &Path, result: &ScanResult) -> (String, usize) {
    let sequence = match (Sequence::open(out), result) {
        (Err(_), Err(error)) => return (format!("`{}` before anything is written", kind(error)), 0),
        (sequence, _) => sequence.unwrap(),
    };
    let is_wrong = |record: &&FrameRecord| {
        let planned_mm = positions_mm[record.index];
        record.commanded_mm != Some(planned_mm)
            || sequence.read(record).unwrap() != simulator.expose(planned_mm, 0)
    };
    let wrong = sequence.frames().iter().filter(is_wrong).count();
    let mut words = match result {
        Ok(_) => {
            let report = verify(&sequence, &Silent).unwrap();
            assert_eq!(report.findings, []);
            assert_eq!(
                (report.good_frames, wrong),
                (positions_mm.len(), 0),
                "WRONG FRAMES in a complete scan"
            );
            "complete".to_owned()
        }
        Err(error) => {
            println!("    {error}");
            format!("`{}` after {} frames", kind(error.cause()), sequence.frames().len())
        }
    };
    if wrong > 0 {
        words += &format!(", {wrong} of them wrong");
    }
    (words, wrong)
}

/// What the journal tells of how a scan came to its end.
fn attempts(out: &Path) -> String {
    let Ok(sequence) = Sequence::open(out) else { return String::new() };
    let mut words = String::new();
    for index in 0..sequence.record().frames {
        let is_of = |event: &&Event| matches!(event, Event::Retake(retake) if retake.index == index);
        let times = match sequence.events().iter().filter(is_of).count() {
            0 => continue,
            1 => "once".to_owned(),
            2 => "twice".to_owned(),
            times => format!("{times} times"),
        };
        words += &format!("; frame {index} failed {times}");
    }
    let homed = sequence.events().iter().filter(|event| matches!(event, Event::Resumed(_))).count();
    if homed > 0 {
        words += "; went on after homing";
    }
    let exposures = sequence.frames().iter().filter_map(|frame| frame.exposure.as_ref());
    if exposures.map(|exposure| exposure.restarts).sum::<usize>() > 0 {
        words += "; the camera was set up anew";
    }
    words
}

/// The name of an error, and of what is behind it.
fn kind(error: &CaptureError) -> String {
    let name = |error: &dyn Debug| {
        let text = format!("{error:?}");
        text.split(|sign: char| !sign.is_alphanumeric()).next().unwrap_or_default().to_owned()
    };
    match error {
        CaptureError::RetriesExhausted { source, .. } => format!("RetriesExhausted: {}", kind(source)),
        CaptureError::Stage(error) => name(error),
        CaptureError::Camera(error) => name(error),
        CaptureError::Sequence(error) => name(error),
        other => name(other),
    }
}
