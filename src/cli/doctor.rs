//! `epirig doctor`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::rig::RigArguments;
use super::scan::Devices;
use super::{CliError, Talk};
use crate::doctor::{Check, DoctorPlan, Report, Verdict, examine};
use crate::profile::Profile;
use epirig_core::fault::Blame;
use epirig_data::storage::free_bytes;
use epirig_devices::stage::StageSource;

/// Check the rig, and predict the uncertainty of heights
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig doctor                          the rig and the plan of rig.toml
  epirig doctor --rig sim                no hardware needed
  epirig doctor --short                  without the measurements that take many moves

The stage is homed and moves within the plan's range. The object must be in place and lit as in the
scan. The exit code is 4 if any check forbids the scan.")]
pub(super) struct Doctor {
    /// Skip the checks that need many moves: mechanical settling and repeatability
    #[arg(long)]
    short: bool,
    /// Folder of the sequence to come; its disk is checked for free space
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
    #[command(flatten)]
    rig: RigArguments,
}

impl Doctor {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let profile = self.rig.profile()?;
        let mut devices = Devices::of(&profile, self.rig.stage.transcript(), talk)?;
        let report = examine_rig(&mut devices, &profile, &self.out, self.short, talk)?;
        talk.result(&report, || describe(&report))?;
        refuse_if_bad(&report)
    }
}

/// Checks the rig of a profile for a scan into `out`.
pub(super) fn examine_rig(
    devices: &mut Devices<'_>,
    profile: &Profile,
    out: &Path,
    short: bool,
    talk: &Talk,
) -> Result<Report, CliError> {
    let plan = DoctorPlan {
        scan: devices.plan.clone(),
        distance_mm: profile.optics.distance_mm,
        relief_mm: profile.target.relief_mm,
        mains_hz: profile.camera.mains_hz,
        free_bytes: free_bytes(out),
        short,
    };
    let mut stage = devices.stages.connect()?;
    Ok(examine(&mut *stage, &mut *devices.camera, &plan, talk)?)
}

/// An error if any check forbids the scan.
pub(super) fn refuse_if_bad(report: &Report) -> Result<(), CliError> {
    let bad: Vec<&str> = of(report, Verdict::Bad).map(|check| check.name).collect();
    match bad.as_slice() {
        [] => Ok(()),
        names => Err(CliError {
            message: format!(
                "the rig is not ready for this scan ({}); follow the advice, or measure with `epirig run --anyway`",
                names.join(", ")
            ),
            blame: Blame::Device,
            report: serde_json::to_value(report).ok(),
        }),
    }
}

pub(super) fn of(report: &Report, verdict: Verdict) -> impl Iterator<Item = &Check> {
    report.checks.iter().filter(move |check| check.verdict == verdict)
}

/// One line per check, and one for its advice.
fn describe(report: &Report) -> String {
    let width = report.checks.iter().map(|check| check.name.len()).max().unwrap_or_default();
    let line = |check: &Check| {
        let verdict = match check.verdict {
            Verdict::Good => "ok",
            Verdict::Unknown => "?",
            Verdict::Warning => "WARNING",
            Verdict::Bad => "BAD",
        };
        let advice = check
            .advice
            .as_ref()
            .map_or(String::new(), |advice| format!("{:1$}-> {advice}\n", "", width + 10));
        format!("{verdict:<8} {:<width$} {}\n{advice}", check.name, check.finding)
    };
    let count = |verdict| of(report, verdict).count();
    let (bad, warnings, unknown) = (count(Verdict::Bad), count(Verdict::Warning), count(Verdict::Unknown));
    let ready = if bad == 0 { "ready" } else { "not ready" };
    let lines: String = report.checks.iter().map(line).collect();
    format!("{lines}{ready}: {bad} bad, {warnings} warning(s), {unknown} unknown\n")
}
