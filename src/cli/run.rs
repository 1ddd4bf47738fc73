//! `epirig run`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::calibrate::tell;
use super::doctor::{examine_rig, of, refuse_if_bad};
use super::match_arguments::MatchArguments;
use super::matching::{advise, brief, match_frames};
use super::need::{check_calibration, check_match};
use super::rig::RigArguments;
use super::scan::{Captured, Course, Devices, RESULTS, scan};
use super::surface::{brief as brief_surface, measure_surface};
use super::verdict::{VerdictArguments, answer};
use super::{CliError, Talk};
use crate::calibrate::read_calibration;
use crate::doctor::{Report, Verdict};
use crate::pipeline::{Frames, Measurement, View, calibrate_sequence};
use crate::profile::Profile;
use crate::results::{MatchSummary, Region, ResultsFolder, ResultsKind, SurfaceSummary, names};
use crate::rig::{calibration_plan, can_be_calibrated};
use epirig_core::fault::Blame;
use epirig_core::grid::Grid;
use epirig_core::shell::quoted;
use epirig_data::sequence::{Sequence, refuse_existing};
use epirig_matcher::MatchOptions;

/// Measure: check the rig, capture, match, and write the results
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig run --out tile-0042                                    as rig.toml says
  epirig run --out tile-0042 --rig sim --set plan.frames=51     no hardware needed

Runs `epirig doctor --short`, `capture`, `calibrate`, `match` and `surface`, one after another. DIR
is the sequence; DIR/results holds the results, and DIR/results/surface/report.html shows them on
one page. Frames are calibrated if the profile plans dark, flat or board frames, or describes a
target on the object. If the surface cannot be measured, for example without a focal length, a note
says why. If the scan is interrupted, `epirig resume DIR --measure` continues it and measures.")]
pub(super) struct Run {
    /// Folder of the new sequence and its results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Continue even if the checks forbid the scan
    #[arg(long)]
    anyway: bool,
    #[command(flatten)]
    rig: RigArguments,
    #[command(flatten)]
    verdict: VerdictArguments,
    #[command(flatten)]
    matching: MatchArguments,
}

#[derive(Serialize)]
struct RunOutput<'a> {
    captured: &'a Captured,
    summary: &'a MatchSummary,
    /// The numbers of the surface, if it could be measured.
    surface: Option<&'a SurfaceSummary>,
}

impl Run {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let profile = self.rig.profile_with(self.verdict.changes())?;
        let options = self.matching.options();
        let transcript = self.rig.stage.transcript();
        let captured = checked_scan(&profile, transcript, (&self.out, &options), self.anyway, talk)
            .inspect_err(|error| tell_how_to_go_on(error, &self.out, &self.matching, talk))?;
        measure_captured(&captured, &self.out, &profile, (&options, Existing::Refused), &self.verdict, talk)
    }
}

/// Takes the new sequence `out` with the rig of a profile, after the checks that it passes; and that its frames can be
/// matched with `options`.
pub(super) fn checked_scan(
    profile: &Profile,
    transcript: Option<&Path>,
    (out, options): (&Path, &MatchOptions),
    anyway: bool,
    talk: &Talk,
) -> Result<Captured, CliError> {
    let mut devices = Devices::of(profile, transcript, talk)?;
    // The folder is checked before anything moves.
    refuse_existing(out)?;
    let report = examine_shortly(&mut devices, profile, out, talk)?;
    if !anyway {
        refuse_if_bad(&report)?;
    }
    // A wrong option is reported before the scan, which may take an hour.
    let configuration = devices.camera.configure(&devices.plan.camera)?;
    let frames = devices.plan.positions_mm.len();
    options.check(configuration.rows, configuration.columns, frames)?;
    let deep = configuration.bit_depth > 8 || devices.plan.section.average > 1 || can_be_calibrated(profile);
    let held = Frames {
        count: frames,
        rows: configuration.rows,
        columns: configuration.columns,
        sample_bytes: if deep { 2 } else { 1 },
    };
    check_match(held, options, None, talk)?;
    scan(devices, out, Course::New, talk)
}

/// Says how a scan that was interrupted goes on with the whole measurement.
fn tell_how_to_go_on(error: &CliError, folder: &Path, matching: &MatchArguments, talk: &Talk) {
    if error.blame == Blame::Resumable {
        let same = if matching.are_usual() { "" } else { ", with the same options of matching" };
        let folder = quoted(folder);
        talk.say(&format!("`epirig resume {folder} --measure` continues the scan and measures{same}"));
    }
}

/// What becomes of a calibration and results that exist.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Existing {
    Refused,
    Replaced,
}

/// A scan that was measured.
pub(super) struct Measured {
    sequence: Sequence,
    measurement: Measurement,
    /// The numbers of the surface, if it could be measured, and where its report is.
    pub(super) surface: Option<(SurfaceSummary, PathBuf)>,
}

/// Measures the sequence in `folder`.
pub(super) fn measure_sequence(
    folder: &Path,
    profile: &Profile,
    (options, existing): (&MatchOptions, Existing),
    verdict: Option<&VerdictArguments>,
    talk: &Talk,
) -> Result<Measured, CliError> {
    let (measurement, results) = measure_frames(profile, (options, existing), folder, None, talk)?;
    results.commit()?;
    let sequence = Sequence::open(folder)?;
    let calibration = read_calibration(&sequence)?;
    advise(&measurement, &sequence, calibration.as_ref(), talk);
    let surface = measure_surface(folder, &folder.join(RESULTS), verdict, talk);
    Ok(Measured { sequence, measurement, surface })
}

/// Measures the sequence in `folder`, which was captured, and prints the results.
pub(super) fn measure_captured(
    captured: &Captured,
    folder: &Path,
    profile: &Profile,
    (options, existing): (&MatchOptions, Existing),
    verdict: &VerdictArguments,
    talk: &Talk,
) -> Result<(), CliError> {
    let Measured { sequence, measurement, surface } =
        measure_sequence(folder, profile, (options, existing), Some(verdict), talk)?;
    let found = surface.as_ref();
    let summary = &measurement.summary;
    let output = RunOutput { captured, summary, surface: found.map(|(surface, _)| surface) };
    talk.result(&output, || {
        let results = folder.join(RESULTS);
        let picture = found.map_or_else(|| results.join(names::DISPARITY), |(_, report)| report.clone());
        let (place, says) = found.map_or_else(Default::default, |(surface, _)| {
            (brief_surface(surface), format!("\n{}\n", answer(surface)))
        });
        format!("{}{}{place}{says}look at {}\n", captured.describe(), brief(&measurement), quoted(&picture))
    })?;
    verdict.end(output.surface, &sequence, talk)
}

/// Checks the rig with few moves, and prints every warning and fault.
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

/// The steps after the scan: calibrates, if there is anything to calibrate with, and matches. `truth` is
/// drawn beside the disparity and used for nothing else. The results are not yet moved into place.
pub(super) fn measure_frames(
    profile: &Profile,
    (options, existing): (&MatchOptions, Existing),
    folder: &Path,
    truth: Option<&Grid<f32>>,
    talk: &Talk,
) -> Result<(Measurement, ResultsFolder), CliError> {
    let (sequence, overwrite) = (Sequence::open(folder)?, existing == Existing::Replaced);
    let calibration = if can_be_calibrated(profile) {
        let record = sequence.record();
        let mut plan = calibration_plan(profile, record.columns, record.rows);
        check_calibration(&sequence, &mut plan, None, talk)?;
        let (found, unfinished) = calibrate_sequence(&sequence, &plan, overwrite, talk)?;
        tell(&found.calibration, unfinished.as_ref(), talk);
        Some((found.calibration, found.maps))
    } else {
        None
    };
    let results = ResultsFolder::create(&folder.join(RESULTS), ResultsKind::Match, overwrite)?;
    let view = View { figure_row: None, truth };
    let asked = (options, &Region::default());
    let measurement = match_frames(&sequence, calibration.as_ref(), asked, (view, None), &results, talk)?;
    Ok((measurement, results))
}
