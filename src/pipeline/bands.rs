//! A match in bands: the survey, the match of a band, and the merge.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;
use tracing::info_span;

use super::error::PipelineError;
use super::match_input::{MatchInput, joined_parts};
use super::need::Frames;
use super::packed::{PACKED, pack_sequence, packed_volume};
use super::{Measurement, View, asked_blocks, band_need, merge_need, written};
use crate::bands::{BandError, BandFolder, BandPlan, BandTask, Memory, PartFault, bands_of};
use crate::calibrate::{Calibration, InputHashes, matched_shape};
use crate::results::{Region, ResultsFolder};
use epirig_calibration::photometry::Maps;
use epirig_core::grid::Grid;
use epirig_core::progress::{Progress, Silent};
use epirig_core::rows::RowSource;
use epirig_core::volume::VolumeShape;
use epirig_data::sequence::Sequence;
use epirig_matcher::{Blocks, MatchOptions, Matcher, Overview};

/// Rows in the middle of the picture whose match tells how long that of a band takes.
const SAMPLE_ROWS: usize = 32;

type Calibrated = (Calibration, Maps);

/// What is matched, in the bands that `bands` makes of the blocks, and the blocks of the match.
fn task(
    sequence: &Sequence,
    calibration: Option<&Calibrated>,
    (options, region): (&MatchOptions, &Region),
    bands: impl FnOnce(&Blocks) -> Vec<Range<usize>>,
) -> Result<(BandTask, Blocks), PipelineError> {
    let calibration = calibration.map(|(calibration, _)| calibration);
    let shape = matched_shape(sequence, calibration)?;
    let blocks = asked_blocks(&shape, calibration, options, region)?;
    let task = BandTask {
        program: super::summary::PROGRAM.to_owned(),
        sequence_uid: sequence.record().uid.clone(),
        frames_blake3: InputHashes::of(sequence).frames,
        rows: shape.rows,
        columns: shape.columns,
        calibration: calibration.map(Calibration::hash),
        region: region.rectangle,
        mask: region.mask.as_ref().map(|mask| mask.facts.clone()),
        settings: options.clone(),
        bands: bands(&blocks),
    };
    Ok((task, blocks))
}

/// Plans the match of `sequence` in `bands`, or in as many as it has blocks if these are fewer, and packs the frames
/// unless it has one block. The plan is written into `folder`; one of the same match that is there stays.
///
/// # Errors
/// [`PipelineError`] of the first step that fails; [`BandError::OtherMatch`] if the plan of another match is there and
/// `overwrite` is not set; [`BandError::Taken`] if something else is there. `anyway` tells whether a scan that is not
/// closed was accepted.
pub fn survey_bands(
    sequence: &Sequence,
    calibration: Option<&Calibrated>,
    (options, region): (&MatchOptions, &Region),
    bands: usize,
    (folder, overwrite, anyway): (&Path, bool, bool),
    progress: &dyn Progress,
) -> Result<BandFolder, PipelineError> {
    let (task, blocks) = task(sequence, calibration, (options, region), |blocks| bands_of(blocks, bands))?;
    let pack = || match blocks.needs_all_rows() {
        true => Ok(()),
        false => pack_sequence(sequence, calibration, &sequence.folder().join(PACKED), progress).map(drop),
    };
    match BandFolder::open(folder) {
        Ok(there) => match difference(&there.plan().task, &task) {
            // What is matched by the same plan stays.
            None if there.plan().contradiction(&blocks).is_none() => {
                pack()?;
                return Ok(there);
            }
            what if !overwrite => {
                let (folder, what) = (folder.to_owned(), what.unwrap_or("a damaged one"));
                return Err(BandError::OtherMatch { folder, what }.into());
            }
            _ => {}
        },
        Err(BandError::NoPlan(_)) => {}
        Err(error) if !overwrite => return Err(error.into()),
        Err(_) => {}
    }
    BandFolder::check_free(folder, overwrite)?;
    pack()?;
    let _span = info_span!("survey").entered();
    let recorded = calibration.map(|(calibration, _)| calibration);
    let shape = matched_shape(sequence, recorded)?;
    let packed = packed_volume(sequence, calibration, progress)?.filter(|_| !blocks.needs_all_rows());
    if packed.is_none() && !blocks.needs_all_rows() {
        // Another process has packed it as something else.
        return Err(BandError::NotPacked.into());
    }
    let (mut overview, mut seconds_of_row) = (None, None);
    if let Some(packed) = packed {
        let source: Arc<dyn RowSource> = Arc::new(packed);
        overview = Matcher::of_source(Arc::clone(&source), blocks.clone(), progress)?.overview(progress)?;
        let asked = MatchOptions { block_rows: None, ..options.clone() };
        seconds_of_row = Some(seconds_of_a_row(source, asked, overview)?);
    }
    let rows = |blocks_of: &Range<usize>| {
        blocks_of.clone().map(|block| blocks.needed_rows(block).len()).sum::<usize>()
    };
    let most_rows = task.bands.iter().map(rows).max().unwrap_or_default();
    let frames = Frames::of(&shape);
    let plan = BandPlan {
        format: BandPlan::FORMAT,
        memory_bytes: Memory { band: band_need(frames, options), merge: merge_need(frames, options) },
        mask_blake3: None,
        anyway,
        threads: rayon::current_num_threads(),
        overview,
        seconds: seconds_of_row.map(|seconds| seconds * most_rows as f64),
        task,
    };
    // It may have been filled since.
    BandFolder::check_free(folder, overwrite)?;
    if !overwrite && !matches!(BandFolder::open(folder), Err(BandError::NoPlan(_))) {
        return Err(BandError::OtherMatch { folder: folder.to_owned(), what: "of another survey" }.into());
    }
    let mask = region.mask.as_ref().map(|mask| mask.inside.clone());
    Ok(BandFolder::create(folder, plan, mask)?)
}

/// Seconds that reading and matching a row takes here, from some in the middle of the picture.
fn seconds_of_a_row(
    source: Arc<dyn RowSource>,
    options: MatchOptions,
    overview: Option<Overview>,
) -> Result<f64, PipelineError> {
    let VolumeShape { rows, columns, .. } = source.shape();
    let mut inside = Grid::filled(rows, columns, false);
    let first = rows.saturating_sub(SAMPLE_ROWS) / 2;
    (first..(first + SAMPLE_ROWS).min(rows)).for_each(|y| inside.row_mut(y).fill(true));
    let blocks = Blocks::new(&source.shape(), options)?.within(&inside)?;
    let begun = Instant::now();
    let matcher = Matcher::of_source(source, blocks, &Silent)?;
    matcher.match_blocks(0..1, overview, &Silent, |_, _| Ok::<_, PipelineError>(()))?;
    Ok(begun.elapsed().as_secs_f64() / matcher.blocks().needed_rows(0).len() as f64)
}

/// What makes `now` another task than the `planned` one, in words; `None` if it is the same.
fn difference(planned: &BandTask, now: &BandTask) -> Option<&'static str> {
    let BandTask { program, sequence_uid, frames_blake3, rows, columns, .. } = planned;
    let BandTask { calibration, region, mask, settings, bands, .. } = planned;
    match () {
        () if *program != now.program => Some("another version of epirig"),
        () if *sequence_uid != now.sequence_uid => Some("another sequence"),
        () if *frames_blake3 != now.frames_blake3 => Some("other frames"),
        () if (*rows, *columns) != (now.rows, now.columns) => Some("frames of another size"),
        () if *calibration != now.calibration => Some("another calibration"),
        () if *region != now.region || *mask != now.mask => Some("another region or mask"),
        () if *settings != now.settings => Some("other options"),
        () if *bands != now.bands => Some("other bands"),
        () => None,
    }
}

/// The match that `folder` plans, as `sequence` and `calibration` are now.
fn planned(
    sequence: &Sequence,
    calibration: Option<&Calibrated>,
    folder: &BandFolder,
) -> Result<(Region, Blocks), PipelineError> {
    let plan = folder.plan();
    let shape = matched_shape(sequence, calibration.map(|(calibration, _)| calibration))?;
    if (plan.task.rows, plan.task.columns) != (shape.rows, shape.columns) {
        let (folder, what) = (folder.path().to_owned(), "frames of another size");
        return Err(BandError::Changed { folder, what }.into());
    }
    let region = folder.region();
    let asked = (&plan.task.settings, &region);
    let (now, blocks) = task(sequence, calibration, asked, |_| plan.task.bands.clone())?;
    let folder = || folder.path().to_owned();
    match (difference(&plan.task, &now), plan.contradiction(&blocks)) {
        (Some(what), _) => Err(BandError::Changed { folder: folder(), what }.into()),
        (None, Some(reason)) => Err(BandError::Contradiction { folder: folder(), reason }.into()),
        (None, None) => Ok((region, blocks)),
    }
}

/// Refuses frames that are not packed, if the match of these `blocks` reads parts of them.
fn check_packed(
    sequence: &Sequence,
    calibration: Option<&Calibrated>,
    blocks: &Blocks,
    progress: &dyn Progress,
) -> Result<(), PipelineError> {
    match blocks.needs_all_rows() || packed_volume(sequence, calibration, progress)?.is_some() {
        true => Ok(()),
        false => Err(BandError::NotPacked.into()),
    }
}

/// What was done for a band.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BandDone {
    /// Its number, from 0.
    pub band: usize,
    /// Number of bands.
    pub bands: usize,
    /// The rows of the picture that it answers: the first, and the one after the last.
    pub rows: (usize, usize),
    /// Blocks whose parts were there already.
    pub matched_before: usize,
    /// Blocks that were matched now.
    pub matched: usize,
}

/// Matches `band` of the plan in `folder`, and leaves its parts there. Blocks whose parts are there and right are not
/// matched again.
///
/// # Errors
/// [`BandError::Changed`] if the plan is of something else than what is there now; [`PipelineError`] of the first step
/// that fails.
pub fn match_band(
    sequence: &Sequence,
    calibration: Option<&Calibrated>,
    folder: &BandFolder,
    band: usize,
    progress: &dyn Progress,
) -> Result<BandDone, PipelineError> {
    let (region, blocks) = planned(sequence, calibration, folder)?;
    let (plan, parts) = (folder.plan(), folder.parts());
    let of_band = folder.blocks(band)?;
    let missing: Vec<usize> =
        of_band.clone().filter(|&block| parts.take(block, &blocks, plan.overview).is_err()).collect();
    if !missing.is_empty() {
        check_packed(sequence, calibration, &blocks, progress)?;
        let recorded = calibration.map(|(calibration, _)| calibration);
        let asked = |shape: &VolumeShape| asked_blocks(shape, recorded, &plan.task.settings, &region);
        let input = MatchInput::of(sequence, calibration, asked, progress)?.ready(progress)?;
        let _span = info_span!("matching", band).entered();
        for run in missing.chunk_by(|block, next| block + 1 == *next) {
            input.match_blocks(run[0]..run[0] + run.len(), plan.overview, parts, progress)?;
        }
    }
    Ok(BandDone {
        band,
        bands: plan.task.bands.len(),
        rows: (blocks.answered_rows(of_band.start).start, blocks.answered_rows(of_band.end - 1).end),
        matched_before: of_band.len() - missing.len(),
        matched: missing.len(),
    })
}

/// The bands of the plan in `folder` of which a part is missing or not to be used.
///
/// # Errors
/// [`BandError::Changed`] if the plan is of something else than what is there now.
pub fn missing_bands(
    sequence: &Sequence,
    calibration: Option<&Calibrated>,
    folder: &BandFolder,
) -> Result<Vec<usize>, PipelineError> {
    let (_, blocks) = planned(sequence, calibration, folder)?;
    check_packed(sequence, calibration, &blocks, &Silent)?;
    Ok(faults(folder, &blocks).into_iter().map(|(band, _)| band).collect())
}

/// The bands of which a part is not to be used, each with the reason.
fn faults(folder: &BandFolder, blocks: &Blocks) -> Vec<(usize, PartFault)> {
    let of_band = |of_band: Range<usize>| {
        of_band.into_iter().find_map(|block| folder.parts().take(block, blocks, folder.plan().overview).err())
    };
    let bands = folder.plan().task.bands.iter().cloned().enumerate();
    bands.filter_map(|(band, blocks)| Some((band, of_band(blocks)?))).collect()
}

/// Joins the parts of all bands of the plan in `results`, as if one process had matched them: the maps are equal to
/// the last bit. The caller commits the folder.
///
/// # Errors
/// [`BandError::Incomplete`] with the bands of which a part is missing, damaged or of another plan;
/// [`BandError::Changed`]; [`PipelineError`] of the first step that fails.
pub fn merge_bands(
    sequence: &Sequence,
    calibration: Option<&Calibrated>,
    folder: &BandFolder,
    view: View<'_>,
    results: &ResultsFolder,
    progress: &dyn Progress,
) -> Result<Measurement, PipelineError> {
    let (region, blocks) = planned(sequence, calibration, folder)?;
    let faults = faults(folder, &blocks);
    if !faults.is_empty() {
        return Err(BandError::Incomplete { bands: folder.plan().task.bands.len(), faults }.into());
    }
    check_packed(sequence, calibration, &blocks, progress)?;
    let matched = |_: &super::ReadyInput| joined_parts(folder.parts(), &blocks, folder.plan().overview);
    written(sequence, calibration, (&folder.plan().task.settings, &region), view, matched, results, progress)
}
