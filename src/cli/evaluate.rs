//! `epirig evaluate`.

use std::path::PathBuf;
use std::sync::Arc;

use clap::{ArgGroup, Args};
use serde::Serialize;

use super::match_arguments::MatchArguments;
use super::memory_limit::MemoryArgument;
use super::need::{check, close_others, frames_of, refuse_more_than_allowed};
use super::region::RegionArguments;
use super::scan_end::{AnywayArgument, tell_results};
use super::{CliError, Talk};
use crate::calibrate::read_calibration;
use crate::pipeline::{Held, OpenedResults, evaluation_need, frames_to_match, open_results, pack_if_large};
use crate::results::{Region, read_map};
use epirig_core::rows::RowSource;
use epirig_data::sequence::Sequence;
use epirig_matcher::evaluate::{
    BothWaysReport, Differences, ErrorStatistics, SplitHalfReport, TruthReport, both_ways,
    compare_with_truth, leave_out, split_half,
};

/// Evaluate disparity: by truth, left-out frames, or a second match
///
/// --truth compares existing results. The other checks match again and need no truth. --leave-out matches
/// without every Kth frame, predicts those frames from the disparity, and compares the error with that of
/// repeating the nearest frame. --split-half matches odd and even frames separately: their difference is
/// twice the error that noise leaves in a match of all frames. --both-ways matches from the first frame and
/// from the last: pixels that disagree are wrong or occluded.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("check").required(true).args(["truth", "leave_out", "split_half", "both_ways"]))]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  epirig evaluate epirig-demo --truth epirig-demo/truth/disparity.pfm
  epirig evaluate seq --truth truth.pfm --mask object.png
  epirig evaluate seq --leave-out 5 --ordering-constraint off
  epirig evaluate seq --split-half
  epirig evaluate seq --both-ways"
)]
pub(super) struct Evaluate {
    /// Folder of the sequence
    seq: PathBuf,
    /// True disparity of the same reference frame, in px: .pfm, .tiff or .npy
    #[arg(long, value_name = "FILE", conflicts_with_all = ["MatchArguments", "MemoryArgument"])]
    truth: Option<PathBuf>,
    /// Folder of the results to compare [default: SEQ/results]
    #[arg(long, value_name = "DIR", requires = "truth")]
    results: Option<PathBuf>,
    #[command(flatten)]
    region: RegionArguments,
    /// Leave out every Kth frame
    #[arg(long, value_name = "K", conflicts_with = "RegionArguments")]
    leave_out: Option<usize>,
    /// Match odd and even frames separately
    #[arg(long, conflicts_with = "RegionArguments")]
    split_half: bool,
    /// Match from the first frame and from the last
    #[arg(long, conflicts_with_all = ["reference", "RegionArguments"])]
    both_ways: bool,
    #[command(flatten)]
    anyway: AnywayArgument,
    #[command(flatten)]
    memory: MemoryArgument,
    #[command(flatten)]
    matching: MatchArguments,
}

#[derive(Serialize)]
struct TruthOutput<'a> {
    truth: &'a TruthReport,
}

impl Evaluate {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        if let Some(every) = self.leave_out {
            return self.leave_out(every, talk);
        }
        if self.split_half {
            let report = split_half(&self.frames(talk)?, &self.matching.options(), talk)?;
            return talk.result(&report, || split_half_table(&report));
        }
        if self.both_ways {
            let report = both_ways(&self.frames(talk)?, &self.matching.options(), talk)?;
            return talk.result(&report, || both_ways_table(&report));
        }
        let Some(truth_file) = &self.truth else {
            return Err(CliError::usage(
                "choose a check: --truth FILE, --leave-out K, --split-half or --both-ways".to_owned(),
            ));
        };
        let folder = self.results.unwrap_or_else(|| self.seq.join("results"));
        let sequence = Sequence::open(&self.seq)?;
        let OpenedResults { matched, disparity, sigma, .. } = open_results(&sequence, &folder)?;
        tell_results(&matched, talk);
        // The results do not hold what was found about the scan later.
        if let Some(words) = sequence.end_in_words() {
            talk.say(&format!("note: {words}"));
        }
        let mut truth = read_map(truth_file)?;
        let region = self.region.region(disparity.rows(), disparity.columns(), talk)?;
        if let Some(inside) = region.inside(disparity.rows(), disparity.columns()) {
            // What has no truth is not compared.
            let places = truth.values_mut().iter_mut().zip(inside.values());
            places.filter(|&(_, &inside)| !inside).for_each(|(truth, _)| *truth = f32::NAN);
        }
        let report =
            compare_with_truth(&disparity, Some(&sigma), &truth, (matched.tau_before, matched.tau_after))?;
        if report.all.pixels == 0 {
            return Err(CliError::data(format!(
                "{}: no pixel has a true value{}; give a map that holds finite numbers there",
                truth_file.display(),
                if region == Region::default() { "" } else { " in the region" }
            )));
        }
        talk.result(&TruthOutput { truth: &report }, || table(&report))
    }

    /// The frames: packed first, if they are more than memory should hold.
    fn frames(&self, talk: &Talk) -> Result<Arc<dyn RowSource>, CliError> {
        let sequence = self.anyway.open(&self.seq, talk)?;
        let calibration = read_calibration(&sequence)?;
        let options = self.matching.options();
        let frames = frames_of(&sequence, calibration.as_ref());
        options.check(frames.rows, frames.columns, frames.count)?;
        let limit = self.memory.limit;
        let least = [Held::InMemory, Held::Packed].map(|held| evaluation_need(frames, &options, held));
        refuse_more_than_allowed("evaluating", least[0].min(least[1]), limit)?;
        let held = pack_if_large(&sequence, calibration.as_ref(), &options, (evaluation_need, limit), talk)?;
        let need = evaluation_need(frames, &options, held);
        refuse_more_than_allowed("evaluating", need, limit)?;
        check("evaluating", need, talk, close_others)?;
        Ok(frames_to_match(&sequence, calibration.as_ref(), &options, talk)?)
    }

    fn leave_out(&self, every: usize, talk: &Talk) -> Result<(), CliError> {
        let (report, _) = leave_out(&self.frames(talk)?, every, &self.matching.options(), talk)?;
        talk.result(&report, || {
            format!(
                "left out           {} frames\n\
                 predicted          {:.1} % of their pixels\n\
                 mean |error|       {:.2} DN predicted, {:.2} DN by repeating the nearest frame (ratio {:.2})\n\
                 at most half of it {:.1} % of all pixels, one by one\n",
                report.frames.len(),
                100.0 * report.predicted,
                report.prediction_error_dn,
                report.repetition_error_dn,
                report.prediction_error_dn / report.repetition_error_dn,
                100.0 * report.halved,
            )
        })
    }
}

fn split_half_table(report: &SplitHalfReport) -> String {
    let row = |name: &str, value: fn(&Differences) -> f64| {
        format!("{name:<34}{:>12.4}{:>16.4}\n", value(&report.answered), value(&report.textured))
    };
    let [even, odd] = report.frames;
    [
        format!(
            "{:<34}{:>12}{:>16}\n",
            format!("{even} frames against {odd}"),
            "answered",
            "sigma <= 0.1 px"
        ),
        row("share of the pixels", |differences| differences.pixels),
        row("median |difference|, px", |differences| differences.median_px),
        row("68 % of |differences| below, px", |differences| differences.percentile_68_px),
        row("95 % of |differences| below, px", |differences| differences.percentile_95_px),
        row("spread over sigma (1)", |differences| differences.spread),
        row("within 1 sigma (0.68)", |differences| differences.within_1_sigma),
        row("within 2 sigma (0.95)", |differences| differences.within_2_sigma),
    ]
    .concat()
}

fn both_ways_table(report: &BothWaysReport) -> String {
    format!(
        "carried to the last frame {:.1} % of the first frame's pixels\n\
         answered there, too       {:.1} % of them\n\
         agree within 3 sigma      {:.2} % of these\n\
         agree within 0.1 px       {:.2} %\n\
         agree within 1 px         {:.2} %\n\
         median |difference|       {:.4} px\n",
        100.0 * report.carried,
        100.0 * report.compared,
        100.0 * report.within_3_sigma,
        100.0 * report.within_0_1_px,
        100.0 * report.within_1_px,
        report.median_px,
    )
}

/// The errors against truth as a table.
pub(super) fn table(report: &TruthReport) -> String {
    let row = |name: &str, value: fn(&ErrorStatistics) -> f64| {
        format!("{name:<26}{:>14.4}{:>18.4}\n", value(&report.all), value(&report.in_both_end_frames))
    };
    let counts = |name: &str, value: fn(&ErrorStatistics) -> usize| {
        format!("{name:<26}{:>14}{:>18}\n", value(&report.all), value(&report.in_both_end_frames))
    };
    [
        format!("{:<26}{:>14}{:>18}\n", "against the truth", "all pixels", "in both ends"),
        counts("pixels with a truth", |errors| errors.pixels),
        counts("of them answered", |errors| errors.answered),
        row("mean |error|, px", |errors| errors.mean_px),
        row("median |error|, px", |errors| errors.median_px),
        row("RMS error, px", |errors| errors.rms_px),
        row("99 % of |errors| below, px", |errors| errors.percentile_99_px),
        row("largest |error|, px", |errors| errors.maximum_px),
        row("bias, px", |errors| errors.bias_px),
        row("within 1 sigma (0.68)", |errors| errors.within_1_sigma),
        row("within 2 sigma (0.95)", |errors| errors.within_2_sigma),
    ]
    .concat()
}
