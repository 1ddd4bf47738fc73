//! `epirig evaluate`.

use std::path::PathBuf;

use clap::{ArgGroup, Args};
use serde::Serialize;

use super::match_arguments::MatchArguments;
use super::{CliError, Talk};
use crate::calibrate::read_calibration;
use crate::evaluate::{ErrorStatistics, TruthReport, compare_with_truth, leave_out};
use crate::measure::load;
use crate::results::{read_map, read_summary};
use crate::sequence::Sequence;

/// Say how good a disparity map is: against truth, or against frames left out
///
/// --truth compares results that are there. --leave-out matches anew without every Kth frame, predicts those frames from
/// the disparity and shows the error beside that of repeating the nearest frame: a check that needs no truth.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("check").required(true).args(["truth", "leave_out"]))]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  epirig evaluate epirig-demo/sequence --truth epirig-demo/sequence/truth/disparity.pfm
  epirig evaluate seq --leave-out 5 --reference middle --ordering free"
)]
pub(super) struct Evaluate {
    /// Folder of the sequence
    seq: PathBuf,
    /// True disparity of the same reference frame, in px: .pfm, .tiff or .npy
    #[arg(long, value_name = "FILE", conflicts_with = "MatchArguments")]
    truth: Option<PathBuf>,
    /// Folder of the results to compare [default: SEQ/results]
    #[arg(long, value_name = "DIR", requires = "truth", conflicts_with = "leave_out")]
    results: Option<PathBuf>,
    /// Leave out every Kth frame
    #[arg(long, value_name = "K")]
    leave_out: Option<usize>,
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
        let Some(truth_file) = &self.truth else {
            return Err(CliError::Usage("give --truth FILE or --leave-out K".to_owned()));
        };
        let folder = self.results.unwrap_or_else(|| self.seq.join("results"));
        let summary = read_summary(&folder)?;
        let disparity = read_map(&folder.join("disparity.tiff"))?;
        let sigma = read_map(&folder.join("sigma.tiff"))?;
        let truth = read_map(truth_file)?;
        let report =
            compare_with_truth(&disparity, Some(&sigma), &truth, (summary.tau_before, summary.tau_after))?;
        talk.result(&TruthOutput { truth: &report }, || table(&report))
    }

    fn leave_out(&self, every: usize, talk: &Talk) -> Result<(), CliError> {
        let sequence = Sequence::open(&self.seq)?;
        let calibration = read_calibration(&sequence)?;
        let volume = load(&sequence, calibration.as_ref(), talk)?;
        let (report, _) = leave_out(&volume, every, &self.matching.options(), talk)?;
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

/// Errors against truth as a table.
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
