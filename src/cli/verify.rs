//! `epirig verify`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{CliError, Talk};
use crate::calibrate::{CALIBRATION, read_calibration};
use crate::profile::Profile;
use crate::results::{ResultFiles, ResultsError, ResultsKind, results_beside};
use epirig_data::sequence::{Finding, Origin, Sequence, verify};

/// Check frames, calibration and results against their records
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
            Err(CliError::data(format!("{}, {file}: {problem}", sequence.folder().display())))
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

/// Files of the results in the folder `name` of a sequence, and of their surface, that differ from their records.
fn findings_of_results(sequence: &Path, name: &str) -> Vec<Finding> {
    let check = || -> Result<Vec<ResultsError>, ResultsError> {
        let results = ResultFiles::open(&sequence.join(name), ResultsKind::Match)?;
        let surface = results.surface().map_or_else(
            |error| vec![error],
            |surface| surface.as_ref().map_or_else(Vec::new, ResultFiles::check),
        );
        Ok(results.check().into_iter().chain(surface).collect())
    };
    let found = check().unwrap_or_else(|error| vec![error]);
    let finding = |error: ResultsError| Finding { file: name.to_owned(), problem: error.to_string() };
    found.into_iter().map(finding).collect()
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
        for name in results_beside(sequence.folder()) {
            report.findings.extend(findings_of_results(sequence.folder(), &name));
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
        let Some(Finding { file, problem }) = report.findings.first() else { return Ok(()) };
        // Who calls from a program may see this line alone.
        Err(CliError::data(format!(
            "{}: {} finding(s), each with what to do; the first is of {file}: {problem}",
            self.seq.display(),
            report.findings.len()
        )))
    }
}
