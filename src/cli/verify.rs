//! `epirig verify`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, Talk};
use crate::profile::Profile;
use crate::sequence::{Finding, Sequence, verify};

/// Check that a sequence is what its records say, and that these agree: hashes, gaps, sizes, positions
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  epirig verify seq\n\nThe exit code is 5 if anything is not as recorded.")]
pub(super) struct Verify {
    /// Folder of the sequence
    seq: PathBuf,
}

impl Verify {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let sequence = Sequence::open(&self.seq)?;
        let mut report = verify(&sequence, talk)?;
        match Profile::of_sequence(&sequence) {
            Ok(rig) => report.findings.extend(rig.iter().flat_map(|rig| rig.contradictions(&sequence))),
            Err(error) => {
                let file = "sequence.json".to_owned();
                report.findings.push(Finding { file, problem: error.to_string() });
            }
        }
        talk.result(&report, || {
            let findings: String = report
                .findings
                .iter()
                .map(|finding| format!("{}: {}\n", finding.file, finding.problem))
                .collect();
            format!("{findings}{} of {} frames are good\n", report.good_frames, report.planned_frames)
        })?;
        match report.findings.len() {
            0 => Ok(()),
            count => Err(CliError::Integrity(format!(
                "{}: {count} thing(s) are not as recorded; see above what to do",
                self.seq.display()
            ))),
        }
    }
}
