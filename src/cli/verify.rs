//! `epirig verify`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, Talk};
use crate::calibrate::{CALIBRATION, read_calibration};
use crate::profile::Profile;
use epirig_data::sequence::{Finding, Origin, Sequence, verify};

/// Check a sequence against its records: hashes, gaps, positions
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  epirig verify seq\n\nThe exit code is 5 if anything differs from the records."
)]
pub(super) struct Verify {
    /// Folder of the sequence
    seq: PathBuf,
}

/// Contradictions between the recorded rig and the other records of a sequence.
pub(super) fn findings_of_rig(sequence: &Sequence, rig: &Profile) -> Vec<Finding> {
    let mut found = rig.contradictions(sequence);
    found.extend(other_simulator(sequence, rig));
    found
}

/// Refuses a sequence whose recorded rig contradicts its other records: one of them is wrong, and it is
/// unknown which.
pub(super) fn refuse_another_rig(sequence: &Sequence, rig: &Profile) -> Result<(), CliError> {
    match findings_of_rig(sequence, rig).first() {
        None => Ok(()),
        Some(Finding { file, problem }) => {
            Err(CliError::Integrity(format!("{}, {file}: {problem}", sequence.folder().display())))
        }
    }
}

/// Compares the simulated rig as recorded with that of the recorded profile.
fn other_simulator(sequence: &Sequence, rig: &Profile) -> Option<Finding> {
    let record = sequence.record();
    let Origin::Captured { simulator: Some(recorded), .. } = &record.origin else { return None };
    // Another version of the program may build it differently.
    let ours = record.program == concat!("epirig ", env!("CARGO_PKG_VERSION"));
    let made =
        crate::rig::simulator_config(rig).ok().and_then(|simulator| serde_json::to_value(simulator).ok());
    (ours && made.as_ref() != Some(recorded)).then(|| Finding {
        file: "sequence.json".to_owned(),
        problem: "the simulated rig differs from the recorded profile; restore the file from a copy"
            .to_owned(),
    })
}

impl Verify {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let sequence = Sequence::open(&self.seq)?;
        let mut report = verify(&sequence, talk)?;
        match Profile::of_sequence(&sequence) {
            Ok(Some(rig)) => report.findings.extend(findings_of_rig(&sequence, &rig)),
            Ok(None) => {}
            Err(error) => {
                let file = "sequence.json".to_owned();
                report.findings.push(Finding { file, problem: error.to_string() });
            }
        }
        if let Err(error) = read_calibration(&sequence) {
            report.findings.push(Finding { file: CALIBRATION.to_owned(), problem: error.to_string() });
        }
        talk.result(&report, || {
            let findings: String = report
                .findings
                .iter()
                .map(|finding| {
                    format!("{}: {}", finding.file, finding.problem).replace('\n', "\u{fffd}") + "\n"
                })
                .collect();
            format!("{findings}{} of {} frames are good\n", report.good_frames, report.planned_frames)
        })?;
        match report.findings.len() {
            0 => Ok(()),
            count => Err(CliError::Integrity(format!(
                "{}: {count} finding(s), listed above with what to do",
                self.seq.display()
            ))),
        }
    }
}
