//! From a sequence to its calibration and its results: the steps in order.

mod bands;
mod calibration;
mod compare;
mod error;
mod geometry;
mod halves;
mod held;
mod inspect;
mod load;
mod match_input;
mod need;
mod opened;
mod packed;
mod photograph;
mod points;
mod rectified;
mod reported;
mod summary;

use std::ops::Range;
use std::time::Instant;

use rayon::prelude::*;
use tracing::{info, info_span};

pub use bands::{BandDone, match_band, merge_bands, missing_bands, survey_bands};
pub use calibration::calibrate_sequence;

use crate::calibrate::Calibration;
use crate::report::{FigureRow, MapPicture, Millimetres, ValueRange, Window, class_picture, paper_figures};
use crate::results::{MatchSummary, Region, ResultMap, ResultsFolder, class_of, names};
use epirig_calibration::photometry::Maps;
use epirig_core::grid::Grid;
use epirig_core::progress::Progress;
use epirig_core::volume::VolumeShape;
use epirig_data::sequence::Sequence;
use epirig_matcher::inspect::EpiLines;
use epirig_matcher::{Blocks, DisparityMaps, MatchError, MatchOptions, Validity};
use epirig_surface::{Heights, heights};

pub use compare::{
    CompareError, CompareSummary, ComparedScans, MeasuredScan, MotionSummary, compare_scans, compared_scans,
};
pub use error::PipelineError;
pub use geometry::geometry;
pub use halves::{half_frames, half_heights};
pub use held::{Need, calibration_held, frames_to_match, held, pack_if_large, where_frames_are};
pub use inspect::{SurfaceAnswers, SurfaceQuestions, analyse_surface, profile_csv, steps_options};
pub use load::load;
use match_input::{MatchInput, ReadyInput};
pub use need::{
    Frames, Held, band_need, calibration_need, capture_need, evaluation_need, frames_that_fit, halves_need,
    import_need, match_need, merge_need, rectification_need, surface_need,
};
pub use opened::{OpenedResults, open_results};
pub use packed::{PACKED, Packed, pack_sequence, packed_volume};
pub use photograph::{frame_in_dn, matched_frame};
pub use points::surface_mesh;
pub use rectified::rectify_sequence;
pub use reported::{MeasuredSurface, inspect_surface};
use summary::summarise;

/// Results of a measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// The matcher's maps.
    pub maps: DisparityMaps,
    /// Heights, if lens and stage axis are known.
    pub heights: Option<Heights>,
    /// The numbers of `match.json`.
    pub summary: MatchSummary,
}

/// Options of the pictures.
#[derive(Debug, Clone, Copy, Default)]
pub struct View<'a> {
    /// Row of the paper's figures, which must have a pixel of the region; by default the middle one of these.
    pub figure_row: Option<usize>,
    /// True disparity, drawn beside the measured one in the figures and used for nothing else; rows x columns
    /// of the matched frames, in px.
    pub truth: Option<&'a Grid<f32>>,
}

/// Matches `sequence` and writes all results into `folder`, which the caller commits. With a calibration the
/// frames are corrected and rectified, and have its measured positions; without one they are matched as
/// captured. Only pixels of `region` are asked for.
///
/// # Errors
/// [`PipelineError`] of the first step that fails.
pub fn measure(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    asked: (&MatchOptions, &Region),
    view: View<'_>,
    folder: &ResultsFolder,
    progress: &dyn Progress,
) -> Result<Measurement, PipelineError> {
    let matched = |input: &ReadyInput| {
        let begun = Instant::now();
        let maps = input.matched(&folder.working_folder()?, progress)?;
        Ok((maps, begun.elapsed().as_secs_f64()))
    };
    written(sequence, calibration, asked, view, matched, folder, progress)
}

/// Writes all results of a match into `folder`. `matched` gives its maps, and the seconds that they took.
fn written(
    sequence: &Sequence,
    calibration: Option<&(Calibration, Maps)>,
    (options, region): (&MatchOptions, &Region),
    View { figure_row, truth }: View<'_>,
    matched: impl FnOnce(&ReadyInput) -> Result<(DisparityMaps, f64), PipelineError>,
    folder: &ResultsFolder,
    progress: &dyn Progress,
) -> Result<Measurement, PipelineError> {
    let recorded = calibration.map(|(calibration, _)| calibration);
    let blocks = |shape: &VolumeShape| asked_blocks(shape, recorded, options, region);
    let input = MatchInput::of(sequence, calibration, blocks, progress)?;
    let calibration = recorded;
    let is_shown = |y: &usize| input.blocks().inside().is_none_or(|inside| inside.row(*y).contains(&true));
    let shown: Vec<usize> = (0..input.blocks().rows()).filter(is_shown).collect();
    let middle = shown.get(shown.len() / 2).copied().unwrap_or_default();
    let y = figure_row.filter(|row| shown.contains(row)).unwrap_or(middle);
    let epi = input.epi(y, progress)?;
    let span = info_span!("matching").entered();
    let reference = input.blocks().reference();
    let photograph = photograph::as_far_as_seen(input.photograph(reference)?, reference, calibration);
    let input = input.ready(progress)?;
    let (maps, seconds) = matched(&input)?;
    let (candidates, costs) = input.row_costs(y, &maps)?;
    drop(input);
    info!(seconds, answered = maps.share(Validity::Found), reference = maps.reference, "matched");
    drop(span);
    let heights = info_span!("surface").in_scope(|| {
        let heights = geometry(sequence, calibration)
            .and_then(|geometry| heights(geometry, &maps.disparity, &maps.sigma));
        info!(distance_mm = heights.as_ref().map(|heights| heights.distance_mm), "heights found");
        heights
    });
    let lines = EpiLines::new(epi.tau(), maps.reference, epi.columns());
    let summary =
        summarise(sequence, calibration, &lines, &maps, (options, region), heights.as_ref(), seconds);

    let _span = info_span!("results").entered();
    progress.begin("writing results", 1);
    let figures = || -> Result<(), PipelineError> {
        let row = FigureRow { y, epi: &epi, candidates, costs: &costs, truth };
        paper_figures(&maps, row)?.into_par_iter().try_for_each(|figure| {
            folder.write(&format!("{}.csv", figure.name), figure.csv);
            Ok(folder.write_picture(&format!("{}.png", figure.name), &figure.picture)?)
        })
    };
    let median_sigma_px = summary.median_sigma_px;
    let maps_and_pictures = || write_maps(folder, &maps, (median_sigma_px, &photograph), heights.as_ref());
    let (figures, written) = rayon::join(figures, maps_and_pictures);
    figures.and(written)?;
    folder.set_record(summary.clone());
    progress.end();
    info!("results packed");
    Ok(Measurement { maps, heights, summary })
}

/// The blocks of a match of frames of this `shape`, whose pixels in `region` are asked for, as far as all frames show
/// them.
fn asked_blocks(
    shape: &VolumeShape,
    calibration: Option<&Calibration>,
    options: &MatchOptions,
    region: &Region,
) -> Result<Blocks, MatchError> {
    let moving = calibration.filter(|found| found.has_motion());
    let seen = moving.map(|found| found.mapping.seen(&found.poses()));
    let blocks = Blocks::new(shape, options.clone())?;
    let blocks = match &seen {
        Some(seen) => blocks.showing(shown_columns(seen))?,
        None => blocks,
    };
    match both(region.inside(shape.rows, shape.columns), seen) {
        Some(inside) => blocks.within(&inside),
        None => Ok(blocks),
    }
}

/// The pixels of two parts of a picture, each all of it if there is none.
fn both(one: Option<Grid<bool>>, other: Option<Grid<bool>>) -> Option<Grid<bool>> {
    let (Some(mut both), Some(other)) = (one.clone(), &other) else { return one.or(other) };
    both.values_mut().iter_mut().zip(other.values()).for_each(|(both, other)| *both = *both && *other);
    Some(both)
}

/// The columns of each row that all frames show, from the first to the last.
fn shown_columns(seen: &Grid<bool>) -> Vec<Range<usize>> {
    let columns = |y: usize| {
        let row = seen.row(y);
        let first = row.iter().position(|&seen| seen).unwrap_or(0);
        first..row.iter().rposition(|&seen| seen).map_or(first, |last| last + 1)
    };
    (0..seen.rows()).map(columns).collect()
}

/// Writes maps and their pictures. Packing takes longer than writing, so files are packed side by side.
fn write_maps(
    folder: &ResultsFolder,
    maps: &DisparityMaps,
    (median_sigma_px, photograph): (Option<f64>, &Grid<f32>),
    heights: Option<&Heights>,
) -> Result<(), PipelineError> {
    /// How a map is drawn.
    type Picture = fn(&Grid<f32>) -> MapPicture<'_>;
    let pixel_mm = heights.map(Heights::pixel_mm);
    let millimetres = heights.map(Millimetres::of);
    let DisparityMaps { disparity, sigma, cost, confidence, .. } = maps;
    let mut files = vec![
        (ResultMap::Disparity, disparity),
        (ResultMap::Sigma, sigma),
        (ResultMap::Cost, cost),
        (ResultMap::Confidence, confidence),
    ];
    let all: Picture = |disparity| MapPicture::of(ResultMap::Disparity, disparity);
    let most: Picture = |disparity| {
        let range = ValueRange::of_most(disparity, ResultMap::Disparity.row().least_span);
        MapPicture::new(disparity, "Disparity, most of it", "px", range)
    };
    let mut pictures = vec![(names::DISPARITY, disparity, all), (names::DISPARITY_DETAIL, disparity, most)];
    if let Some(Heights { height_mm, sigma_mm, .. }) = heights {
        files.extend([(ResultMap::Height, height_mm), (ResultMap::HeightSigma, sigma_mm)]);
        pictures.push((names::HEIGHT, height_mm, |height| MapPicture::of(ResultMap::Height, height)));
    }
    let draw = |&(name, map, picture): &(&str, &Grid<f32>, Picture)| {
        let picture = picture(map).in_mm(millimetres).beside(Some(photograph));
        Ok(folder.write_picture(name, &picture.picture()?)?)
    };
    let draw_sigma = || -> Result<(), PipelineError> {
        // Sigma at borders is many times that of the surface, so the range is that of the surface.
        let range = ValueRange { low: 0.0, high: 3.0 * median_sigma_px.unwrap_or(1.0) as f32 };
        let picture = MapPicture::over(ResultMap::Sigma, sigma, range).in_mm(millimetres);
        Ok(folder.write_picture(names::SIGMA, &picture.picture()?)?)
    };
    let draw_all = || {
        let (sigma, others) = rayon::join(draw_sigma, || pictures.par_iter().try_for_each(draw));
        others.and(sigma)
    };
    let write = |&(map, values): &(ResultMap, &Grid<f32>)| {
        folder.write_map(map.row().file, values, &map.row().facts(pixel_mm, None))
    };
    let (drawn, written) = rayon::join(draw_all, || files.par_iter().try_for_each(write));
    drawn?;
    written?;
    let mask = maps.validity.map(|validity| class_of(validity).value);
    let whole = Window::whole(mask.rows(), mask.columns());
    let answers = class_picture(ResultMap::Mask, &mask, (&whole, millimetres))?;
    folder.write_picture(names::ANSWERS, &answers)?;
    Ok(folder.write_grey(ResultMap::Mask.row().file, &mask)?)
}
