//! `epirig repeat`.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::RangedU64ValueParser;
use serde_json::Value as Json;

use super::characterise::characterise;
use super::match_arguments::MatchArguments;
use super::resume::resumed_scan;
use super::rig::{RigArguments, given};
use super::run::{Existing, checked_scan, measure_sequence};
use super::{CliError, Talk};
use crate::profile::Profile;
use crate::series::{SequenceState, SeriesEntry};
use epirig_core::fault::Blame;
use epirig_core::shell::quoted;
use epirig_data::sequence::Sequence;
use epirig_matcher::MatchOptions;

/// Scan one object many times, and tell how the results repeat
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig repeat 10 --out repeats                    as rig.toml says
  epirig repeat 4 --out repeats --rig sim           no hardware needed

Takes and measures the sequences 001, 002 and so on in FOLDER as `epirig run` does, without anybody
beside the rig, and prints what `epirig characterise FOLDER` says of them. The stage is homed before
and after each scan. After an interruption the same command goes on: what is measured stays, a scan
that is not complete is resumed. A larger N adds scans. A simulated rig has other noise in each scan.")]
pub(super) struct Repeat {
    /// How many scans there shall be
    #[arg(value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(2..=999))]
    count: usize,
    /// Folder of the sequences
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Continue even if the checks forbid a scan
    #[arg(long)]
    anyway: bool,
    #[command(flatten)]
    rig: RigArguments,
    #[command(flatten)]
    matching: MatchArguments,
}

impl Repeat {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let (profile, options) = (self.rig.profile()?, self.matching.options());
        for number in 1..=self.count {
            let folder = self.out.join(format!("{number:03}"));
            let profile = of_scan(&profile, number)?;
            let told = self.one(&folder, &profile, &options, talk).inspect_err(|error| {
                if error.blame == Blame::Resumable {
                    talk.say("the same command goes on with the scans");
                }
            })?;
            talk.say(&format!("scan {number} of {}: {told}", self.count));
        }
        characterise(&self.out, talk)
    }

    /// Does what is left to do for one of the sequences; returns what was found, in a sentence.
    fn one(
        &self,
        folder: &Path,
        profile: &Profile,
        options: &MatchOptions,
        talk: &Talk,
    ) -> Result<String, CliError> {
        let measured = if folder.exists() {
            let recorded = profile_of_scan(folder, profile)?;
            let entry = SeriesEntry::of(folder, String::new());
            if entry.state == SequenceState::Measured && entry.problem.is_none() {
                return Ok(format!("{} is measured already", quoted(folder)));
            }
            resumed_scan(&recorded, folder, Some(options), talk)?;
            measure_sequence(folder, &recorded, (options, Existing::Replaced), None, talk)?
        } else {
            let transcript = self.rig.stage.transcript();
            checked_scan(profile, transcript, (folder, options), self.anyway, talk)?;
            measure_sequence(folder, profile, (options, Existing::Refused), None, talk)?
        };
        Ok(measured.surface.map_or_else(
            || "its surface was not measured".to_owned(),
            |(surface, _)| surface.conclusion.sentence.clone(),
        ))
    }
}

/// The profile for scan `number`, counted from 1. A simulated camera would else take the same frames again.
fn of_scan(profile: &Profile, number: usize) -> Result<Profile, CliError> {
    let scan = profile.camera.is_simulated().then_some(profile.sim.scan as usize + number - 1);
    let changes: Vec<_> = given("sim.scan", "epirig repeat", scan).into_iter().collect();
    Ok(profile.clone().changed(&changes)?)
}

/// The recorded profile of the scan in `folder`, which has not the scripted faults of a simulated rig any more. One that
/// differs from `wanted` in anything else is refused.
fn profile_of_scan(folder: &Path, wanted: &Profile) -> Result<Profile, CliError> {
    let recorded = Profile::of_sequence(&Sequence::open(folder)?)?;
    let folder = quoted(folder);
    let recorded =
        recorded.ok_or_else(|| CliError::usage(format!("{folder} is no scan; give --out a new folder")))?;
    match first_difference(&recorded.record(), &wanted.record()) {
        None => Ok(recorded),
        Some(key) => Err(CliError::usage(format!(
            "{folder} was scanned with another {key}; scans that are compared need the same profile: give --out a new folder"
        ))),
    }
}

/// The first key whose values differ.
fn first_difference(recorded: &Json, wanted: &Json) -> Option<String> {
    let sections = recorded.as_object()?.keys().chain(wanted.as_object()?.keys());
    sections.into_iter().find_map(|section| {
        let keys = |record: &Json| record[section].as_object().cloned().unwrap_or_default();
        let (ours, theirs) = (keys(recorded), keys(wanted));
        let mut names = ours.keys().chain(theirs.keys());
        // Those that are recorded were taken out: they have happened.
        let differs = |name: &&String| *name != "faults" && ours.get(*name) != theirs.get(*name);
        names.find(differs).map(|name| format!("{section}.{name}"))
    })
}
