//! `epirig measure`.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::calibrate::tell;
use super::import::{Afterwards, ImportArguments, describe};
use super::match_arguments::MatchArguments;
use super::matching::{advise, brief, match_frames, refuse_no_answer};
use super::motion_sentence::motion_sentence;
use super::need::{check_calibration, check_match, frames_of};
use super::no_answer::cause;
use super::scan_end::AnywayArgument;
use super::surface::{brief as brief_surface, measure_surface};
use super::verdict::{VerdictArguments, answer};
use super::{CliError, Talk};
use crate::calibrate::{CALIBRATION, CalibrateError, Calibration, CalibrationPlan, PositionSource};
use crate::number::{ascii, sigma};
use crate::pipeline::{Frames, PipelineError, View, calibrate_sequence};
use crate::profile::Profile;
use crate::results::{MatchSummary, Region, ResultsError, ResultsFolder, ResultsKind, SurfaceSummary, names};
use crate::rig::calibration_plan;
use epirig_calibration::texture_motion::TextureMotionError;
use epirig_core::fault::{Blame, Fault as _};
use epirig_core::shell::quoted;
use epirig_data::sequence::import::Imported;
use epirig_data::sequence::{FrameKind, Sequence, refuse_existing};
use epirig_matcher::MatchOptions;

/// Measure photographs: find their motion, match, write the results
///
/// For a camera that moved along a line, without a rig: neither steps nor lens need be known. With
/// --step-mm or --positions, and a focal length by EXIF or --focal-length-px, heights are in mm.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    mut_group("ImportArguments", |options| options.requires("out")),
    mut_arg("anyway", |option| option.conflicts_with("out")),
    after_help = "Examples:
  epirig measure photos/ --out first
  epirig measure scan.mp4 --out first --every 10              needs the program ffmpeg
  epirig measure seq                                          a sequence that was imported
  epirig measure photos/ --out first --step-mm 1.5 --focal-length-px 2844
  epirig measure photos/ --out first --sort motion --exclude 47,52..53

Does what `epirig import`, `calibrate --positions texture`, `match` and `surface` do, one after another.
DIR is the sequence, and DIR/results holds the results. If heights are in mm, DIR/results/surface/report.html
shows them on one page; else a note says what is missing. If the profile of --rig describes a target on the
object, the positions come from it. If the motion cannot be measured, the sequence stays, and
`epirig match DIR` measures it as it is."
)]
pub(super) struct Measure {
    /// Folder, images, a pattern in quotes, or a video, as for `epirig import`; or a sequence, which is measured in
    /// its place
    #[arg(required = true, value_name = "PHOTOS")]
    photos: Vec<PathBuf>,
    /// Folder of the new sequence and its results; not for a sequence that exists
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace calibration and results of a sequence that exists
    #[arg(long, conflicts_with = "out")]
    overwrite: bool,
    #[command(flatten)]
    anyway: AnywayArgument,
    #[command(flatten, next_help_heading = "Import")]
    importing: ImportArguments,
    #[command(flatten)]
    verdict: VerdictArguments,
    #[command(flatten)]
    matching: MatchArguments,
}

#[derive(Serialize)]
struct MeasureOutput<'a> {
    /// What was imported; nothing of a sequence that existed.
    imported: Option<&'a Imported>,
    /// What was found, in a sentence.
    sentence: &'a str,
    summary: &'a MatchSummary,
    /// The numbers of the surface, if it could be measured.
    surface: Option<&'a SurfaceSummary>,
}

impl Measure {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        self.verdict.check()?;
        let options = self.matching.options();
        match (&self.out, &self.photos[..]) {
            (None, [folder]) if is_sequence(folder) => {
                let sequence = self.anyway.open(folder, talk)?;
                let frames = Frames { sample_bytes: 2, ..frames_of(&sequence, None) };
                check_asked(frames, &options, talk)?;
                measure_sequence(&sequence, None, (&options, self.overwrite), &self.verdict, talk)
            }
            (None, _) => Err(CliError::usage(
                "photographs are imported into a folder that is made anew; name it with --out DIR",
            )),
            (Some(_), [folder]) if is_sequence(folder) => Err(CliError::usage(format!(
                "{} is a sequence already; `epirig measure {}` measures it, without --out",
                folder.display(),
                quoted(folder)
            ))),
            (Some(out), photos) => self.measure_photos(photos, out, &options, talk),
        }
    }

    fn measure_photos(
        &self,
        photos: &[PathBuf],
        out: &Path,
        options: &MatchOptions,
        talk: &Talk,
    ) -> Result<(), CliError> {
        refuse_existing(out)?;
        let prepared = self.importing.prepare(photos, out, talk)?;
        // A wrong option is reported before there is a folder.
        if let Some(frames) = prepared.frames()? {
            check_asked(frames, options, talk)?;
        }
        let (imported, _) = prepared.import(Afterwards::Measured, talk)?;
        measure_sequence(&Sequence::open(out)?, Some(&imported), (options, false), &self.verdict, talk)
    }
}

/// Whether the folder is one that `import` or `capture` made.
fn is_sequence(folder: &Path) -> bool {
    folder.join("sequence.json").exists()
}

/// Refuses options of the matcher that do not fit the frames, and frames that do not fit into memory.
fn check_asked(frames: Frames, options: &MatchOptions, talk: &Talk) -> Result<(), CliError> {
    options.check(frames.rows, frames.columns, frames.count)?;
    check_match(frames, options, None, talk)
}

/// Calibrates and matches a sequence, measures its surface, and prints the results.
fn measure_sequence(
    sequence: &Sequence,
    imported: Option<&Imported>,
    (options, overwrite): (&MatchOptions, bool),
    verdict: &VerdictArguments,
    talk: &Talk,
) -> Result<(), CliError> {
    let folder = sequence.folder();
    let out = folder.join("results");
    // Results that may not be replaced are reported before the work.
    let results =
        ResultsFolder::create(&out, ResultsKind::Match, overwrite).map_err(|error| match error {
            ResultsError::Exists(path) => CliError::usage(format!(
                "{} holds results already; add --overwrite to replace calibration and results",
                path.display()
            )),
            other => other.into(),
        })?;
    let mut plan = plan_of(sequence)?;
    check_calibration(sequence, &mut plan, None, talk)?;
    let found = calibrate_sequence(sequence, &plan, overwrite, talk);
    let (found, unfinished) = found.map_err(|error| refused(error, sequence))?;
    tell_found(&found.calibration, unfinished.as_ref(), sequence, talk);
    let calibration = (found.calibration, found.maps);
    let used = Some(&calibration);
    let asked = (options, &Region::default());
    let measurement = match_frames(sequence, used, asked, (View::default(), None), &results, talk)?;
    results.commit()?;
    advise(&measurement, sequence, used, talk);
    let summary = &measurement.summary;
    let has_answers = summary.median_disparity_px.is_some();
    let surface = if has_answers { measure_surface(folder, &out, Some(verdict), talk) } else { None };
    let found = surface.as_ref();
    let sentence = &format!("{}; {}", motion_sentence(&calibration.0), answers(summary));
    let output = MeasureOutput { imported, sentence, summary, surface: found.map(|(surface, _)| surface) };
    talk.result(&output, || {
        let images = imported.map_or_else(String::new, |imported| describe(folder, imported));
        let (place, depth) =
            found.map_or_else(Default::default, |(surface, _)| (brief_surface(surface), answer(surface)));
        let picture = found.map_or_else(|| out.join(names::DISPARITY), |(_, report)| report.clone());
        let look = if has_answers { format!("look at {}\n", quoted(&picture)) } else { String::new() };
        format!("{images}{}{place}\n{depth}{sentence}\n\n{look}", brief(&measurement))
    })?;
    refuse_no_answer(&measurement, sequence, used, &out)?;
    verdict.end(output.surface, sequence, talk)
}

/// The plan of the recorded profile, if there is one. Positions are those of the texture, unless there is a target.
fn plan_of(sequence: &Sequence) -> Result<CalibrationPlan, CliError> {
    let profile = match Profile::of_sequence(sequence)? {
        Some(recorded) => recorded.of_lens_and_targets()?,
        None => Profile::of(&[])?,
    };
    let record = sequence.record();
    let mut plan = calibration_plan(&profile, record.columns, record.rows);
    if plan.target.is_none() {
        plan.positions = PositionSource::Texture;
    }
    Ok(plan)
}

/// Prints the calibration's notes. What a rig could do better is told in full only if there is one.
fn tell_found(
    calibration: &Calibration,
    unfinished: Option<&CalibrateError>,
    sequence: &Sequence,
    talk: &Talk,
) {
    let has_frames = FrameKind::CALIBRATION.iter().any(|&kind| !sequence.calibration_frames(kind).is_empty());
    if has_frames || calibration.stage_axis.is_some() || calibration.needs.is_empty() {
        return tell(calibration, unfinished, talk);
    }
    let without = Calibration { needs: Vec::new(), ..calibration.clone() };
    tell(&without, unfinished, talk);
    talk.say(&format!(
        "note: {} lists what would give better results, under \"needs\"",
        quoted(&sequence.folder().join(CALIBRATION))
    ));
}

/// Why the calibration was refused, and what can be done with the sequence.
fn refused(error: PipelineError, sequence: &Sequence) -> CliError {
    let matches = format!("`epirig match {}`", quoted(sequence.folder()));
    let blame = error.blame();
    let message = match error {
        PipelineError::Calibrate(CalibrateError::TextureMotion(why)) if says_what_to_do(&why) => {
            format!("the motion cannot be measured: {why}")
        }
        PipelineError::Calibrate(CalibrateError::TextureMotion(why)) => {
            // What the frames show besides is better advice.
            let cause = cause(sequence, None).filter(|_| why == TextureMotionError::NothingFollowed);
            let advice = cause.unwrap_or_else(|| format!("{matches} measures the frames as they are"));
            format!("the motion cannot be measured: {why}; {advice}")
        }
        PipelineError::Calibrate(CalibrateError::Apart { found, cure }) => format!(
            "the motion cannot be measured: {found} cannot be connected with the others, because they share too little texture, or it repeats; \
             {cure} measure the frames as they are: {matches}"
        ),
        PipelineError::Calibrate(CalibrateError::Returns { found, cure }) => format!(
            "each frame must stand beyond the one before, but {found}; {cure} measure the frames as they are: {matches}"
        ),
        other if blame == Blame::Rejection => {
            format!("{}; {matches} measures the frames as they are", other.message())
        }
        other => return other.into(),
    };
    CliError::new(blame, message)
}

/// Whether the frames cannot be measured as they are, either.
fn says_what_to_do(why: &TextureMotionError) -> bool {
    let nothing = matches!(why, TextureMotionError::NoTexture | TextureMotionError::Still);
    nothing || why.clone().of_other_motion(1.0).is_some()
}

/// How much is answered, and how well.
fn answers(summary: &MatchSummary) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let answered = match summary.object {
        none if none <= 0.0 => format!("{} of the frame", percent(summary.answered)),
        // Of a small part the share says little.
        part if part < 0.5 => format!(
            "{} of the object, which is {} of the frame,",
            percent(summary.object_answered),
            percent(part)
        ),
        _ => format!("{} of the object", percent(summary.object_answered)),
    };
    let median = summary.median_sigma_px.map_or("unknown".to_owned(), |px| ascii(&sigma(px, "px")));
    format!("{answered} answered, median sigma {median}")
}
