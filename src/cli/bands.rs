//! The steps of a match in bands of rows: the survey, each band, and the merge.

use std::path::Path;

use clap::Args;

use super::need::{close_others, refuse_more_than_there_is, size};
use super::scan_end::AnywayArgument;
use super::{CliError, Talk};
use crate::bands::{BandFolder, BandPlan, Memory};
use crate::calibrate::{Calibration, read_calibration};
use crate::pipeline::{BandDone, Measurement, View, match_band, merge_bands, survey_bands};
use crate::results::{Region, ResultsFolder};
use epirig_calibration::photometry::Maps;
use epirig_core::grid::Grid;
use epirig_core::shell::quoted;
use epirig_data::sequence::Sequence;
use epirig_matcher::MatchOptions;

/// One step of a match by several processes.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Bands of rows, for several processes or machines")]
pub(super) struct BandArguments {
    /// Plan the match in bands of rows, as SEQ/bands: find what holds for the whole picture, and pack the frames.
    /// --overwrite replaces the plan of another match
    #[arg(long, conflicts_with_all = ["band", "merge", "out", "figure_row", "limit"])]
    survey: bool,
    /// With --survey: number of bands [default: as many as there are blocks, see --block-rows]
    #[arg(long, value_name = "N", requires = "survey", conflicts_with_all = ["band", "merge"],
        value_parser = clap::value_parser!(u32).range(1..))]
    bands: Option<u32>,
    /// Match one band of the plan, from 0 on, with the options of the plan. What is matched already stays
    #[arg(long, value_name = "K", conflicts_with_all = ["merge", "out", "overwrite", "figure_row", "limit",
        "as_captured", "region", "mask", "anyway", "MatchArguments"])]
    band: Option<usize>,
    /// Join all bands of the plan to the results: the same, to the last bit, as without bands
    #[arg(long, conflicts_with_all = ["as_captured", "limit", "region", "mask", "anyway", "MatchArguments"])]
    merge: bool,
}

/// A step of a match in bands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BandStep {
    /// Plans this number of bands, at most.
    Survey(usize),
    /// Matches one.
    Band(usize),
    /// Joins them.
    Merge,
}

impl BandArguments {
    /// The step, if one is asked for.
    pub(super) fn step(&self) -> Option<BandStep> {
        match self.band {
            Some(band) => Some(BandStep::Band(band)),
            None if self.survey => {
                Some(BandStep::Survey(self.bands.map_or(usize::MAX, |bands| bands as usize)))
            }
            None => self.merge.then_some(BandStep::Merge),
        }
    }
}

/// A sequence with a plan, as the plan needs it.
pub(super) struct Planned {
    pub(super) sequence: Sequence,
    pub(super) calibration: Option<(Calibration, Maps)>,
    folder: BandFolder,
}

impl Planned {
    /// Opens the plan of the sequence in `folder`.
    pub(super) fn open(folder: &Path, talk: &Talk) -> Result<Self, CliError> {
        let bands = BandFolder::open(&folder.join(BandFolder::NAME))?;
        let sequence = AnywayArgument::of(bands.plan().anyway).open(folder, talk)?;
        let folder = bands;
        let is_calibrated = folder.plan().task.calibration.is_some();
        let calibration = if is_calibrated { read_calibration(&sequence)? } else { None };
        Ok(Self { sequence, calibration, folder })
    }

    fn plan(&self) -> &BandPlan {
        self.folder.plan()
    }

    pub(super) fn folder(&self) -> &BandFolder {
        &self.folder
    }

    /// Rows of a frame, and whether each pixel is asked for; `None` if all are.
    pub(super) fn asked(&self) -> (usize, Option<Grid<bool>>) {
        let task = &self.plan().task;
        (task.rows, self.folder.region().inside(task.rows, task.columns))
    }

    /// Matches a band.
    pub(super) fn match_band(&self, band: usize, talk: &Talk) -> Result<(), CliError> {
        let need = self.plan().memory_bytes.band;
        refuse_more_than_there_is("matching a band", need, close_others)?;
        let done = match_band(&self.sequence, self.calibration.as_ref(), &self.folder, band, talk)?;
        talk.result(&done, || {
            let BandDone { band, bands, rows, matched_before, matched } = done;
            let state = match (matched_before, matched) {
                (_, 0) => "was matched already".to_owned(),
                (0, _) => "is matched".to_owned(),
                (before, now) => format!("is matched: {before} of its {} blocks were before", before + now),
            };
            format!("band {band} of {bands}, rows {} .. {}, {state}\n", rows.0, rows.1 - 1)
        })
    }

    /// Joins all bands in `results`.
    pub(super) fn merge(
        &self,
        view: View<'_>,
        results: &ResultsFolder,
        talk: &Talk,
    ) -> Result<Measurement, CliError> {
        refuse_more_than_there_is("merging", self.plan().memory_bytes.merge, close_others)?;
        Ok(merge_bands(&self.sequence, self.calibration.as_ref(), &self.folder, view, results, talk)?)
    }
}

/// Plans the match of the sequence in `folder` in `bands` bands, or in as many as it has blocks if these are fewer.
pub(super) fn survey(
    (sequence, folder): (&Sequence, &Path),
    calibration: Option<&(Calibration, Maps)>,
    asked: (&MatchOptions, &Region),
    (bands, overwrite, anyway): (usize, bool, AnywayArgument),
    talk: &Talk,
) -> Result<(), CliError> {
    let place = (&*folder.join(BandFolder::NAME), overwrite, anyway.is_given());
    let made = survey_bands(sequence, calibration, asked, bands, place, talk)?;
    let plan = made.plan();
    let count = plan.task.bands.len();
    if bands != usize::MAX && count < bands {
        talk.say(&format!(
            "note: the match has {count} blocks of rows, so there are no more bands; a smaller --block-rows gives more"
        ));
    }
    talk.result(plan, || {
        let Memory { band, merge } = plan.memory_bytes;
        let time = plan.seconds.map_or(String::new(), |seconds| format!(" and about {:.0} s", seconds.ceil()));
        let (place, seq) = (quoted(made.path()), quoted(folder));
        let last = count - 1;
        format!(
            "{place}: {count} bands; each takes up to {} of memory{time}, and the merge {}\n\
             next: `epirig match {seq} --band K` for each K from 0 to {last}, in any order, on any machines that see the folder; \
             then `epirig match {seq} --merge`. With Slurm: `epirig submit {seq}`\n",
            size(band),
            size(merge)
        )
    })
}
