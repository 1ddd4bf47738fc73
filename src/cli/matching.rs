//! `epirig match`.

use std::path::PathBuf;

use clap::Args;

use super::match_arguments::MatchArguments;
use super::need::{check_match, frames_of};
use super::no_answer::no_answer;
use super::scan_end::AnywayArgument;
use super::{CliError, Talk};
use crate::calibrate::{CALIBRATION, read_calibration};
use crate::pipeline::{Measurement, PipelineError, View, measure};
use crate::results::{ResultsFolder, ResultsKind};
use epirig_data::sequence::{FrameKind, Sequence};
use epirig_matcher::MatchError;

/// Compute the disparity of every pixel, and its height if lens and stage axis are known
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:
  epirig match seq
  epirig match seq --reference middle --ordering-constraint off      objects that occlude others
  epirig match seq --method normalised                     illumination that varies
  epirig match seq --range 420..434 --out results          a range that is known
  epirig match seq --quick --out look                      a first look: a third of the time

The results are maps (disparity.pfm, .tiff, .npy; sigma, cost, confidence, height_mm as .tiff),
mask.png (255 answer, 0 leaves the image, 40 beyond the range, 80 no texture, 120 occluded,
160 ambiguous), answers.png (the same in colours), pictures, figures/ and match.json."
)]
pub(super) struct Match {
    /// Folder of the sequence
    seq: PathBuf,
    /// Folder of the results [default: SEQ/results]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace existing results
    #[arg(long)]
    overwrite: bool,
    /// Row of the reference frame that the figures show [default: the middle one]
    #[arg(long, value_name = "ROW")]
    figure_row: Option<usize>,
    /// Match the frames as captured, without the calibration of `epirig calibrate`
    #[arg(long)]
    as_captured: bool,
    #[command(flatten)]
    anyway: AnywayArgument,
    #[command(flatten)]
    matching: MatchArguments,
}

impl Match {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let options = self.matching.options();
        let sequence = Sequence::open(&self.seq)?;
        self.anyway.check(&sequence, talk)?;
        let calibration = if self.as_captured { None } else { read_calibration(&sequence)? };
        self.tell_calibration(&sequence, calibration.is_some(), talk);
        let record = sequence.record();
        let (rows, columns) =
            calibration.as_ref().map_or((record.rows, record.columns), |(calibration, _)| {
                (calibration.mapping.camera.rows, calibration.mapping.camera.columns)
            });
        if let Some(row) = self.figure_row.filter(|&row| row >= rows) {
            let last = rows - 1;
            return Err(CliError::Usage(format!("there is no row {row} to draw; the last is {last}")));
        }
        options.check(rows, columns, sequence.frames().len())?;
        let out = self.out.unwrap_or_else(|| self.seq.join("results"));
        let folder = ResultsFolder::create(&out, ResultsKind::Match, self.overwrite)?;
        let surface = out.join("surface");
        let drops_surface = surface.exists();
        check_match(
            frames_of(&sequence, calibration.as_ref().map(|(calibration, _)| calibration)),
            &options,
            talk,
        )?;
        let view = View { figure_row: self.figure_row, truth: None };
        let measured = measure(&sequence, calibration.as_ref(), &options, view, &folder, talk);
        if matches!(measured, Err(PipelineError::Match(MatchError::NoRange))) {
            return Err(no_answer(&sequence, "no range of disparities is significant in the data"));
        }
        let measurement = measured?;
        folder.commit()?;
        if drops_surface {
            talk.say(&format!(
                "note: {} belonged to the replaced results and was removed; run `epirig surface {}` again",
                surface.display(),
                self.seq.display()
            ));
        }
        advise(&measurement, talk);
        talk.result(&measurement.summary, || {
            let picture = out.join("disparity.png");
            match measurement.summary.median_disparity_px {
                Some(_) => format!("{}look at {}\n", describe(&measurement), picture.display()),
                None => describe(&measurement),
            }
        })?;
        match measurement.summary.median_disparity_px {
            Some(_) => Ok(()),
            None => {
                let reasons = out.join("mask.png");
                let what = format!("no pixel has an answer ({} has the reasons)", reasons.display());
                Err(no_answer(&sequence, &what))
            }
        }
    }
}

impl Match {
    /// Reports whether a calibration is applied, if there is one or could be one.
    fn tell_calibration(&self, sequence: &Sequence, calibrated: bool, talk: &Talk) {
        let path = self.seq.join(CALIBRATION);
        let has_frames =
            FrameKind::CALIBRATION.iter().any(|&kind| !sequence.calibration_frames(kind).is_empty());
        if calibrated {
            talk.say(&format!(
                "note: corrected and rectified by {}; --as-captured switches that off",
                path.display()
            ));
        } else if self.as_captured && path.exists() {
            talk.say(&format!("note: {} is ignored because of --as-captured", path.display()));
        } else if !self.as_captured && has_frames {
            talk.say(&format!(
                "note: the sequence has calibration frames and no {CALIBRATION}; run `epirig calibrate {}` first; now the frames are matched as \
                 they were captured",
                self.seq.display()
            ));
        }
    }
}

/// Prints hints about pixels without an answer.
pub(super) fn advise(measurement: &Measurement, talk: &Talk) {
    let summary = &measurement.summary;
    let at_end = summary.tau_before == 0.0 || summary.tau_after == 0.0;
    if summary.leaves_image > 0.2 && at_end {
        talk.say(&format!(
            "hint: {:.0} % of the pixels leave the image too early for an answer; try --reference middle",
            100.0 * summary.leaves_image
        ));
    }
    if summary.beyond_range > 0.05 {
        talk.say(&format!(
            "hint: for {:.0} % of the pixels the best candidate is at an end of the range; widen --range or omit it",
            100.0 * summary.beyond_range
        ));
    }
    if summary.answered < 0.2 && summary.leaves_image < 0.5 {
        talk.say(
            "hint: few pixels have an answer. The range may not cover the scene (omit --range), the motion may not be along \
             the rows (rotate the images), or the surface shows little texture",
        );
    }
    if let Some(locking) = summary.pixel_locking.as_ref().filter(|locking| locking.share_locked > 0.05)
        && let Some((low, high)) = locking.locked_px
    {
        talk.say(&format!(
            "hint: {:.0} % of the answered pixels, at disparities in {low:.2} .. {high:.2} px, show pixel locking: a common error of up to {:.4} px{}. Sigma \
             includes it, and averaging does not reduce it. The frames repeat nearly the same fractions of a pixel; scan with another number of frames or \
             another step, or defocus slightly",
            100.0 * locking.share_locked,
            locking.worst_bias_px.abs(),
            if locking.from_lines { "" } else { " (or a half or third of that: depends on the texture)" },
        ));
    }
    if let Some(median_px) = summary.median_disparity_px.filter(|median_px| median_px.abs() < 0.1) {
        talk.say(&format!(
            "hint: the median disparity is {median_px:.3} px over the whole baseline: most of the answered pixels hardly move along the rows"
        ));
    }
}

/// The measurement in a few lines.
pub(super) fn describe(measurement: &Measurement) -> String {
    let summary = &measurement.summary;
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.4}"));
    let frames = if summary.calibration.is_some() { "corrected and rectified" } else { "as captured" };
    let mut text = format!(
        "frames             {frames}, positions from the {}\n\
         range searched     {:.2} .. {:.2} px{}\n\
         ordering constraint {}\n\
         answered           {:.1} % (leaves image {:.1} %, beyond range {:.1} %, no texture {:.1} %, ambiguous {:.1} %, occluded {:.1} %)\n\
         median disparity   {} px, median sigma {} px\n",
        summary.positions,
        summary.minimum_px,
        summary.maximum_px,
        if summary.range_found { " (found from the data)" } else { "" },
        summary.ordering_constraint,
        100.0 * summary.answered,
        100.0 * summary.leaves_image,
        100.0 * summary.beyond_range,
        100.0 * summary.no_texture,
        100.0 * summary.ambiguous,
        100.0 * summary.occluded,
        number(summary.median_disparity_px),
        number(summary.median_sigma_px),
    );
    if let Some(locking) = &summary.pixel_locking {
        text.push_str(&match locking.worst_disparity_px {
            Some(disparity_px) => format!(
                "pixel locking      up to {:.4} px at {disparity_px:.2} px; affects {:.1} % of the answers\n",
                locking.worst_bias_px.abs(),
                100.0 * locking.share_locked
            ),
            None => format!(
                "pixel locking      not significant (amplitude {:.4} +- {:.4} px)\n",
                locking.interpolation_px.first().copied().unwrap_or_default(),
                locking.interpolation_sigma_px.first().copied().unwrap_or_default(),
            ),
        });
    }
    if let Some(distance_mm) = summary.distance_mm {
        text.push_str(&format!("median distance    {distance_mm:.2} mm\n"));
    }
    text.push_str(&format!("matching took      {:.1} s\n", summary.seconds));
    text
}
