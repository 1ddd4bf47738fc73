//! `epirig run`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::calibrate::tell;
use super::capture::RigArguments;
use super::doctor::{examine_rig, of, refuse_if_bad};
use super::match_arguments::MatchArguments;
use super::matching::{advise, describe};
use super::need::check_match;
use super::rig::{calibration_plan, can_be_calibrated};
use super::scan::{Captured, Course, Devices, scan};
use super::{CliError, Talk};
use crate::doctor::{Report, Verdict};
use crate::pipeline::{Frames, Measurement, View, calibrate_sequence, measure};
use crate::profile::Profile;
use crate::results::{MatchSummary, ResultsFolder, ResultsKind};
use epirig_core::grid::Grid;
use epirig_data::sequence::{Sequence, refuse_existing};
use epirig_matcher::MatchOptions;

/// Measure: examine the rig, capture, match, and write the results
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig run --out tile-0042                                    as rig.toml says
  epirig run --out tile-0042 --rig sim --set plan.frames=51     no hardware needed
  epirig run --out tile-0042 --reference middle

It does what `epirig doctor --short`, `capture`, `calibrate` and `match` do, one after another; DIR is the sequence, DIR/results are the \
results. Frames are calibrated if the profile plans dark, flat or board frames or describes a target on the object. If the scan is \
interrupted, `epirig resume DIR`, `epirig calibrate DIR` and `epirig match DIR` do the rest.")]
pub(super) struct Run {
    /// Folder of the new sequence and its results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Go on even if the examination forbids it
    #[arg(long)]
    anyway: bool,
    #[command(flatten)]
    rig: RigArguments,
    #[command(flatten)]
    matching: MatchArguments,
}

#[derive(Serialize)]
struct RunOutput<'a> {
    captured: &'a Captured,
    summary: &'a MatchSummary,
}

/// A measurement whose results are not yet in their place.
pub(super) struct Measured {
    pub(super) captured: Captured,
    pub(super) measurement: Measurement,
    pub(super) results: ResultsFolder,
}

impl Run {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let profile = self.rig.profile()?;
        let mut devices = Devices::of(&profile, self.rig.stage.transcript(), talk)?;
        // Nothing moves for a folder that cannot be used.
        refuse_existing(&self.out)?;
        let report = examine_shortly(&mut devices, &profile, &self.out, talk)?;
        if !self.anyway {
            refuse_if_bad(&report)?;
        }
        // An hour's scan is not to end with an option that makes no sense.
        let configuration = devices.camera.configure(&devices.plan.camera)?;
        let frames = devices.plan.positions_mm.len();
        self.matching.options().check(configuration.rows, configuration.columns, frames)?;
        let deep = configuration.bit_depth > 8 || devices.plan.averaged > 1 || can_be_calibrated(&profile);
        let held = Frames {
            count: frames,
            rows: configuration.rows,
            columns: configuration.columns,
            sample_bytes: if deep { 2 } else { 1 },
        };
        check_match(held, &self.matching.options(), talk)?;
        let measured = measure_object(devices, &profile, &self.matching.options(), &self.out, None, talk)?;
        let Measured { captured, measurement, results } = measured;
        results.commit()?;
        advise(&measurement, talk);
        let output = RunOutput { captured: &captured, summary: &measurement.summary };
        talk.result(&output, || {
            let picture = self.out.join("results").join("disparity.png");
            format!("{}{}look at {}\n", captured.describe(), describe(&measurement), picture.display())
        })
    }
}

/// The examination that needs few moves: says what is not as it should be.
pub(super) fn examine_shortly(
    devices: &mut Devices<'_>,
    profile: &Profile,
    out: &Path,
    talk: &Talk,
) -> Result<Report, CliError> {
    let report = examine_rig(devices, profile, out, true, talk)?;
    for (verdict, word) in [(Verdict::Warning, "warning"), (Verdict::Bad, "BAD")] {
        for check in of(&report, verdict) {
            let advice = check.advice.as_ref().map_or(String::new(), |advice| format!(" ({advice})"));
            talk.say(&format!("{word}: {}: {}{advice}", check.name, check.finding));
        }
    }
    Ok(report)
}

/// From the rig to results: each step on what the one before has left in `folder`. `truth` is drawn beside the disparity
/// and used for nothing else.
pub(super) fn measure_object(
    devices: Devices<'_>,
    profile: &Profile,
    options: &MatchOptions,
    folder: &Path,
    truth: Option<&Grid<f32>>,
    talk: &Talk,
) -> Result<Measured, CliError> {
    let captured = scan(devices, folder, Course::New, talk)?;
    let sequence = Sequence::open(folder)?;
    let calibration = if can_be_calibrated(profile) {
        let record = sequence.record();
        let plan = calibration_plan(profile, record.columns, record.rows);
        let found = calibrate_sequence(&sequence, &plan, false, talk)?;
        tell(&found.calibration, talk);
        Some((found.calibration, found.maps))
    } else {
        None
    };
    let results = ResultsFolder::create(&folder.join("results"), ResultsKind::Match, false)?;
    let view = View { figure_row: None, truth };
    let measurement = measure(&sequence, calibration.as_ref(), options, view, &results, talk)?;
    Ok(Measured { captured, measurement, results })
}
