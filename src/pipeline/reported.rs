//! Analyses a surface, and writes files, pictures and the report.

use std::path::Path;

use super::inspect::{SurfaceAnswers, SurfaceQuestions, analyse_surface, chart, write_answers};
use super::{OpenedResults, PipelineError, matched_frame};
use crate::calibrate::{calibration_pictures, frames_in_order, read_calibration_picture};
use crate::report::html::{CalibrationPart, Maps, Report, Scan};
use crate::results::{ResultMap, ResultsFolder, SurfaceSummary, names};
use epirig_core::grid::Grid;
use epirig_data::sequence::{Sequence, now};
use epirig_data::storage::read_file;
use epirig_surface::{HalfHeights, Heights};

/// The maps that heights are computed from.
const SOURCES: [ResultMap; 2] = [ResultMap::Disparity, ResultMap::Sigma];

/// Results of a sequence that have heights.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredSurface<'a> {
    /// The sequence.
    pub sequence: &'a Sequence,
    /// Its results.
    pub opened: &'a OpenedResults,
    /// The heights.
    pub heights: &'a Heights,
    /// The heights by halves of the frames, if they are known.
    pub halves: Option<&'a [HalfHeights; 2]>,
}

/// Answers `questions` about a surface, and writes the answers into `folder`, which the caller commits: maps,
/// pictures, numbers, and the report.
///
/// # Errors
/// As [`analyse_surface`]; and [`PipelineError::Results`] if they cannot be written.
pub fn inspect_surface(
    measured: MeasuredSurface<'_>,
    questions: &SurfaceQuestions,
    folder: &ResultsFolder,
) -> Result<SurfaceSummary, PipelineError> {
    let answers = analyse_surface(measured.heights, measured.halves, measured.opened, questions)?;
    // The report and the pictures do without a frame that is no longer there; the report says so.
    let (opened, sequence) = (measured.opened, measured.sequence);
    let photograph = matched_frame(sequence, opened.calibration.as_ref(), opened.matched.reference).ok();
    let photograph = photograph.as_ref();
    let report = surface_report(measured, (questions, &answers), photograph)?;
    folder.write(names::REPORT, report);
    let taken = &sequence.record().created;
    write_answers(folder, measured.heights, &answers, (taken, photograph))?;
    Ok(answers.summary)
}

/// The logo in a file; or why there is none, in words. A report is made all the same.
fn logo(name: &str) -> Result<Vec<u8>, String> {
    /// The report holds it whole.
    const MOST_BYTES: u64 = 4 << 20;
    read_file(Path::new(name), MOST_BYTES).map_err(|error| error.to_string())
}

/// The report of `answers` about a surface, as HTML.
fn surface_report(
    measured: MeasuredSurface<'_>,
    (questions, answers): (&SurfaceQuestions, &SurfaceAnswers),
    matched_frame: Option<&Grid<f32>>,
) -> Result<String, PipelineError> {
    let MeasuredSurface { sequence, opened, heights, .. } = measured;
    let hashed = SOURCES.map(|map| map.row().file).into_iter();
    let hashed = hashed.filter_map(|name| Some((name, opened.files.hash_of(name)?.to_owned())));
    // The report does without a frame or a picture that is no longer there.
    let calibration = opened.calibration.as_ref().map(|(calibration, _)| calibration);
    let frame = frames_in_order(sequence, calibration).get(opened.matched.reference).copied();
    let photograph = frame.and_then(|record| sequence.read(record).ok());
    let folder = sequence.folder();
    let picture = |name: String| {
        let bytes = read_calibration_picture(folder, &name).ok()?;
        Some((name, bytes))
    };
    let calibration = opened.calibration.as_ref().map(|(record, _)| CalibrationPart {
        record,
        pictures: calibration_pictures(folder).into_iter().filter_map(picture).collect(),
    });
    let report = Report {
        name: sequence.name(),
        made: now(),
        stated: questions.report.rows(),
        logo: questions.report.logo.as_deref().map(logo),
        scan: Scan {
            record: sequence.record(),
            frames: sequence.frames(),
            events: sequence.events(),
            stop: sequence.stop(),
            end_in_words: sequence.end_in_words(),
        },
        matched: &opened.matched,
        map_hashes: hashed.collect(),
        calibration,
        surface: &answers.summary,
        profile: &chart(&answers.profile, &answers.summary),
        maps: Maps {
            photograph: photograph.as_ref(),
            matched_frame,
            rest_mm: &answers.rest_mm,
            sigma_mm: &heights.sigma_mm,
            disparity_px: &opened.disparity,
            used: &answers.used,
        },
    };
    Ok(report.html()?)
}
