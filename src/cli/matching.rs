//! `epirig match`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::bands::{BandArguments, BandStep, Planned, survey};
use super::match_arguments::MatchArguments;
use super::memory_limit::MemoryArgument;
use super::need::{check_match, frames_of};
use super::no_answer::{cause, no_answer};
use super::region::RegionArguments;
use super::scan_end::AnywayArgument;
use super::{CliError, Talk};
use crate::calibrate::{CALIBRATION, Calibration, read_calibration};
use crate::pipeline::{Measurement, PipelineError, View, match_need, measure, pack_if_large};
use crate::results::{
    ANSWER_CLASSES, MatchSummary, Region, ResultMap, ResultsFolder, ResultsKind, class_of, names,
};
use epirig_calibration::photometry::Maps;
use epirig_core::choice::Choice as _;
use epirig_core::grid::Grid;
use epirig_core::shell::quoted;
use epirig_data::sequence::{FrameKind, Sequence};
use epirig_matcher::{DisparityMaps, MatchError, MatchOptions, Validity};

/// Compute the disparity of every pixel, and its height
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = format!("Examples:
  epirig match seq
  epirig match seq --ordering-constraint off               objects that occlude others
  epirig match seq --method normalised                     illumination that varies
  epirig match seq --range 420..434 --out results          a range that is known
  epirig match seq --quick --out look                      a first look: a third of the time
  epirig match seq --mask object.png                       only what is white, in less time

The results are maps as .tiff ({}),
mask.png ({}), answers.png (the same in colours), pictures, figures/ and match.json.", maps(), classes())
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
    region: RegionArguments,
    #[command(flatten)]
    anyway: AnywayArgument,
    #[command(flatten)]
    memory: MemoryArgument,
    #[command(flatten)]
    bands: BandArguments,
    #[command(flatten)]
    matching: MatchArguments,
}

/// The maps of quantities, as their files are called.
fn maps() -> String {
    let rows = ResultMap::ALL.iter().map(|map| map.row()).filter(|row| row.kind == ResultsKind::Match);
    rows.filter_map(|row| row.file.strip_suffix(".tiff")).collect::<Vec<_>>().join(", ")
}

/// The values of the mask, each with its meaning.
fn classes() -> String {
    ANSWER_CLASSES.map(|class| format!("{} {}", class.value, class.name)).join(", ")
}

impl Match {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let options = self.matching.options();
        let step = self.bands.step();
        if let Some(BandStep::Band(_) | BandStep::Merge) = step {
            let planned = Planned::open(&self.seq, talk)?;
            return match step {
                Some(BandStep::Band(band)) => planned.match_band(band, talk),
                _ => self.merge(&planned, talk),
            };
        }
        let sequence = self.anyway.open(&self.seq, talk)?;
        let calibration = if self.as_captured { None } else { read_calibration(&sequence)? };
        self.tell_calibration(&sequence, calibration.is_some(), talk);
        let used = calibration.as_ref();
        let frames = frames_of(&sequence, used);
        let (rows, columns) = (frames.rows, frames.columns);
        options.check(rows, columns, frames.count)?;
        let region = self.region.region(rows, columns, talk)?;
        if let Some(BandStep::Survey(bands)) = step {
            let asked = (&options, &region);
            return survey((&sequence, &self.seq), used, asked, (bands, self.overwrite, self.anyway), talk);
        }
        self.check_figure_row(rows, region.inside(rows, columns).as_ref())?;
        let out = self.out();
        let folder = ResultsFolder::create(&out, ResultsKind::Match, self.overwrite)?;
        check_match(frames, &options, self.memory.limit, talk)?;
        let view = View { figure_row: self.figure_row, truth: None };
        let measurement =
            match_frames(&sequence, used, (&options, &region), (view, self.memory.limit), &folder, talk)?;
        self.end(&measurement, &sequence, used, folder, talk)
    }

    /// Joins the bands of a plan.
    fn merge(&self, planned: &Planned, talk: &Talk) -> Result<(), CliError> {
        let (rows, inside) = planned.asked();
        self.check_figure_row(rows, inside.as_ref())?;
        let folder = ResultsFolder::create(&self.out(), ResultsKind::Match, self.overwrite)?;
        let view = View { figure_row: self.figure_row, truth: None };
        let measurement = planned.merge(view, &folder, talk)?;
        self.end(&measurement, &planned.sequence, planned.calibration.as_ref(), folder, talk)
    }

    /// Folder of the results.
    fn out(&self) -> PathBuf {
        self.out.clone().unwrap_or_else(|| self.seq.join("results"))
    }

    /// Refuses a row for the figures that frames of `rows` rows do not have, or that has no pixel `inside`.
    fn check_figure_row(&self, rows: usize, inside: Option<&Grid<bool>>) -> Result<(), CliError> {
        let Some(row) = self.figure_row else { return Ok(()) };
        if row >= rows {
            let last = rows - 1;
            return Err(CliError::usage(format!("there is no row {row} to draw; the last is {last}")));
        }
        match inside.is_none_or(|inside| inside.row(row).contains(&true)) {
            true => Ok(()),
            false => Err(CliError::usage(format!(
                "row {row} cannot be drawn, because no pixel of it is inside; give --figure-row another one"
            ))),
        }
    }

    /// Puts the results in `folder` in place, and tells them.
    fn end(
        &self,
        measurement: &Measurement,
        sequence: &Sequence,
        calibration: Option<&(Calibration, Maps)>,
        folder: ResultsFolder,
        talk: &Talk,
    ) -> Result<(), CliError> {
        let out = self.out();
        let surface = out.join("surface");
        let drops_surface = surface.exists();
        folder.commit()?;
        if drops_surface {
            talk.say(&format!(
                "note: {} belonged to the replaced results and was removed; run `epirig surface {}` again",
                quoted(&surface),
                quoted(&self.seq)
            ));
        }
        advise(measurement, sequence, calibration, talk);
        let has_answers = measurement.summary.median_disparity_px.is_some();
        talk.result(&measurement.summary, || {
            let picture = format!("look at {}\n", quoted(&out.join(names::DISPARITY)));
            describe(measurement) + if has_answers { &picture } else { "" }
        })?;
        refuse_no_answer(measurement, sequence, calibration, &out)
    }

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
                quoted(&self.seq)
            ));
        }
    }
}

/// Matches the frames into `folder`, with `limit` bytes of memory or half of what is free. Without a range of disparities
/// the failure tells what they show of the motion.
pub(super) fn match_frames(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    asked: (&MatchOptions, &Region),
    (view, limit): (View<'_>, Option<u64>),
    folder: &ResultsFolder,
    talk: &Talk,
) -> Result<Measurement, CliError> {
    pack_if_large(sequence, calibration, asked.0, (match_need, limit), talk)?;
    let measured = measure(sequence, calibration, asked, view, folder, talk);
    if matches!(measured, Err(PipelineError::Match(MatchError::NoRange))) {
        let what = "no range of disparities is significant in the data";
        return Err(no_answer(sequence, calibration, what, false));
    }
    Ok(measured?)
}

/// The failure of a match whose results in `out` have no answer.
pub(super) fn refuse_no_answer(
    measurement: &Measurement,
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    out: &Path,
) -> Result<(), CliError> {
    let summary = &measurement.summary;
    if summary.median_disparity_px.is_some() {
        return Ok(());
    }
    let reasons = out.join(ResultMap::Mask.row().file);
    let what = format!("no pixel has an answer ({} has the reasons)", reasons.display());
    Err(no_answer(sequence, calibration, &what, summary.settings.range.is_some()))
}

/// Prints hints about pixels without an answer, not two about the same ones.
pub(super) fn advise(
    measurement: &Measurement,
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    talk: &Talk,
) {
    /// An object as small as this share of the frame may be what is left of a larger one.
    const MUCH: f64 = 0.05;
    let summary = &measurement.summary;
    let asked = 1.0 - summary.outside;
    let at_end = summary.tau_before == 0.0 || summary.tau_after == 0.0;
    let mut hinted = false;
    if summary.leaves_image > 0.2 * asked && at_end {
        hinted = true;
        talk.say(&format!(
            "hint: {:.0} % of the pixels leave the image too early for an answer; try --reference middle",
            100.0 * summary.leaves_image / asked
        ));
    }
    // A range that was found covers what moves; the rest is no object.
    if summary.beyond_range > 0.05 * asked && !summary.range_found {
        hinted = true;
        talk.say(&format!(
            "hint: for {:.0} % of the pixels the best candidate is at an end of the range; widen --range or omit it",
            100.0 * summary.beyond_range / asked
        ));
    }
    if !hinted && summary.object * summary.object_answered < 0.5 * summary.object.max(MUCH * asked) {
        talk.say(&format!(
            "hint: few pixels have an answer: {}",
            cause(sequence, calibration).unwrap_or_else(|| {
                let semi_global = if summary.settings.semi_global { "" } else { ", or try --semi-global" };
                format!(
                    "the surface may show little texture for its noise (give more light{semi_global}); the motion is along the rows and in its \
                     steps, as far as it can be measured"
                )
            })
        ));
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

/// A smaller share is shown as 0.0 %.
const LEAST_SHARE: f64 = 5e-4;
/// A smaller number of px is shown as 0.0000.
const LEAST_PX: f64 = 5e-5;

/// How much of the object is answered, and what is beside it.
fn answers(maps: &DisparityMaps) -> String {
    let object = maps.object();
    let all = object.values().len().max(1) as f64;
    let count = |inside: bool, validity: Option<Validity>| {
        let pixels = object.values().iter().zip(maps.validity.values());
        pixels.filter(|&(&is, &has)| is == inside && validity.is_none_or(|validity| has == validity)).count()
            as f64
    };
    // The shares of the answers, without those that round to nothing.
    let shares = |inside: bool, whole: f64| {
        let share = |&validity: &Validity| {
            let percent = 100.0 * count(inside, Some(validity)) / whole;
            let name = class_of(validity).name;
            (percent >= 100.0 * LEAST_SHARE).then(|| format!("{name} {percent:.1} %"))
        };
        // Of the object, the answered share is named before.
        let answers = Validity::ALL.iter().filter(|&&validity| !inside || validity != Validity::Found);
        answers.filter_map(share).collect::<Vec<_>>().join(", ")
    };
    let (inside, outside) = (count(true, None), count(false, None));
    let mut text = String::new();
    if inside > 0.0 {
        let missing = shares(true, inside);
        let missing = if missing.is_empty() { missing } else { format!(" ({missing})") };
        text.push_str(&format!(
            "object             {:.1} % of the frame; {:.1} % of it answered{missing}\n",
            100.0 * inside / all,
            100.0 * count(true, Some(Validity::Found)) / inside,
        ));
    }
    // Beside an object that fills the frame there is nothing to tell.
    if inside <= 0.0 || outside >= LEAST_SHARE * all {
        let name = if inside > 0.0 { "beside it" } else { "frame" };
        let reasons = shares(false, all);
        let reasons = if reasons.is_empty() { reasons } else { format!(": {reasons}") };
        text.push_str(&format!("{name:<19}{:.1} % of the frame{reasons}\n", 100.0 * outside / all));
    }
    text
}

/// What is answered, in two lines or three.
pub(super) fn brief(measurement: &Measurement) -> String {
    answers(&measurement.maps) + &median(&measurement.summary)
}

fn median(summary: &MatchSummary) -> String {
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.4}"));
    format!(
        "median disparity   {} px, median sigma {} px\n",
        number(summary.median_disparity_px),
        number(summary.median_sigma_px)
    )
}

/// The measurement in a few lines.
pub(super) fn describe(measurement: &Measurement) -> String {
    let summary = &measurement.summary;
    let frames = if summary.calibration.is_some() { "corrected and rectified" } else { "as captured" };
    let positions = match summary.positions.as_str() {
        "equal-steps" => "steps taken as equal".to_owned(),
        source => format!("positions from the {source}"),
    };
    let mut text = format!(
        "frames             {frames}, {positions}\n\
         range searched     {:.2} .. {:.2} px{}\n\
         ordering constraint {}\n\
         {}{}",
        summary.minimum_px,
        summary.maximum_px,
        if summary.range_found { " (found from the data)" } else { "" },
        summary.ordering_constraint,
        answers(&measurement.maps),
        median(summary),
    );
    if let Some(locking) = &summary.pixel_locking {
        text.push_str(&match locking.worst_disparity_px {
            Some(_) if locking.worst_bias_px.abs() < LEAST_PX || locking.share_locked < LEAST_SHARE => {
                "pixel locking      none that shows\n".to_owned()
            }
            Some(disparity_px) => format!(
                "pixel locking      up to {:.4} px at {disparity_px:.2} px; affects {:.1} % of the answers\n",
                locking.worst_bias_px.abs(),
                100.0 * locking.share_locked
            ),
            None => format!(
                "pixel locking      not significant (amplitude {:.4} px, sigma {:.4} px)\n",
                locking.interpolation_px.first().copied().unwrap_or_default(),
                locking.interpolation_sigma_px.first().copied().unwrap_or_default(),
            ),
        });
    }
    if let Some(light) = summary.light.and_then(|light| light.in_words()) {
        text.push_str(&format!("light              {light}: taken off\n"));
    }
    if let Some(distance_mm) = summary.distance_mm {
        text.push_str(&format!("median distance    {distance_mm:.2} mm\n"));
    }
    text.push_str(&format!("matching took      {:.1} s\n", summary.seconds));
    text
}
