//! Results of a sequence, read back and compared with it.

use std::path::Path;

use super::{PipelineError, geometry};
use crate::calibrate::{Calibration, InputHashes, frames_in_order, read_calibration};
use crate::profile::{Profile, ReportProfile};
use crate::results::{MatchSummary, ResultFiles, ResultMap, ResultsError, ResultsKind, ResultsMismatch};
use epirig_calibration::photometry::Maps;
use epirig_core::grid::Grid;
use epirig_data::sequence::{FrameRecord, Sequence};
use epirig_surface::conformity::Specification;
use epirig_surface::{Heights, heights};

/// Results of `epirig match`, with what they were made with.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenedResults {
    /// Their files.
    pub files: ResultFiles,
    /// The summary.
    pub matched: MatchSummary,
    /// The calibration that the frames were rectified with.
    pub calibration: Option<(Calibration, Maps)>,
    /// Disparity in px; rows x columns of the matched frames.
    pub disparity: Grid<f32>,
    /// Its sigma in px.
    pub sigma: Grid<f32>,
    /// Heights; `None` without geometry, or if no pixel has a disparity.
    pub heights: Option<Heights>,
    /// Whether focal length and positions are known.
    pub has_geometry: bool,
    /// Depth that the rig's profile plans (`target.relief`), in mm, if one is recorded with the sequence.
    pub planned_mm: Option<f64>,
    /// What that profile asks of the surface (`target.tolerance`); without limits if none is recorded.
    pub specification: Specification,
    /// What that profile wants the report to say (`report`).
    pub report: ReportProfile,
}

impl OpenedResults {
    /// Where the bands of the calibration's target lie; `None` without such a target. Rows x columns of the
    /// matched frames.
    pub fn target(&self) -> Option<Grid<bool>> {
        let (calibration, _) = self.calibration.as_ref()?;
        let outlines = &calibration.stage_axis.as_ref()?.target;
        let tau = *calibration.positions.tau.get(self.matched.reference)?;
        let mut target = self.disparity.map(|_| false);
        for y in 0..target.rows() {
            for (x, covered) in target.row_mut(y).iter_mut().enumerate() {
                *covered = outlines.iter().any(|outline| outline.covers(x as f64, y as f64, tau));
            }
        }
        (!outlines.is_empty()).then_some(target)
    }

    /// The record of the reference frame in the sequence that these are results of.
    ///
    /// # Errors
    /// [`PipelineError::NoSuchFrame`] for another sequence.
    pub fn reference_record<'a>(&self, sequence: &'a Sequence) -> Result<&'a FrameRecord, PipelineError> {
        let calibration = self.calibration.as_ref().map(|(calibration, _)| calibration);
        let reference = self.matched.reference;
        let frame = frames_in_order(sequence, calibration).get(reference).copied();
        frame.ok_or(PipelineError::NoSuchFrame(reference))
    }

    /// The `values` of a map of these results in the pixels of the reference frame as it was taken. Each takes the value
    /// of the nearest rectified pixel; one without such a pixel was not measured. Frames that were matched as captured
    /// have their pixels already.
    pub fn in_original_frame(&self, map: ResultMap, values: Grid<f32>) -> Grid<f32> {
        let Some((calibration, _)) = &self.calibration else { return values };
        let poses = if calibration.has_motion() { calibration.poses() } else { Vec::new() };
        let pose = poses.get(self.matched.reference).copied().unwrap_or_default();
        calibration.mapping.in_raw_frame(&pose, &values, map.row().unknown())
    }

    /// A map of these results, or of their `surface`; `None` if they do not have it. One of another size than the
    /// disparity is not theirs.
    ///
    /// # Errors
    /// [`ResultsError`] of a file that cannot be read, or is another one than when it was written.
    pub fn map(
        &self,
        map: ResultMap,
        surface: Option<&ResultFiles>,
    ) -> Result<Option<Grid<f32>>, ResultsError> {
        let heights = self.heights.as_ref();
        let found = match map {
            ResultMap::Disparity => Some(self.disparity.clone()),
            ResultMap::Sigma => Some(self.sigma.clone()),
            ResultMap::Height => heights.map(|heights| heights.height_mm.clone()),
            ResultMap::HeightSigma => heights.map(|heights| heights.sigma_mm.clone()),
            map => match map.row().kind {
                ResultsKind::Match => self.files.map(map)?,
                ResultsKind::Surface => surface.map(|surface| surface.map(map)).transpose()?.flatten(),
                ResultsKind::Compare => None,
            },
        };
        let size = |map: &Grid<f32>| (map.rows(), map.columns());
        let Some(mut found) = found else { return Ok(None) };
        if size(&found) != size(&self.disparity) {
            tracing::warn!(%map, "it has another size than the disparity, and is not shown");
            return Ok(None);
        }
        if let (ResultMap::HeightUsed, Some(heights)) = (map, heights) {
            let pairs = found.values_mut().iter_mut().zip(heights.height_mm.values());
            pairs.filter(|(used, _)| used.is_finite()).for_each(|(used, height)| *used = *height);
        }
        Ok(Some(found))
    }
}

/// Reads the results of `sequence` in `folder`. Whatever uses results asks here whether they belong to the sequence
/// and to its calibration, and are whole.
///
/// # Errors
/// [`PipelineError`] if they cannot be read, [`PipelineError::Mismatch`] if they do not belong to the sequence
/// or contradict themselves.
pub fn open_results(sequence: &Sequence, folder: &Path) -> Result<OpenedResults, PipelineError> {
    sequence.check_records()?;
    let (files, matched) = ResultFiles::open_match(folder)?;
    let (sequence_folder, results) = (sequence.folder().to_owned(), folder.to_owned());
    if matched.sequence_uid != sequence.record().uid {
        return Err(ResultsMismatch::OtherSequence { results, sequence: sequence_folder }.into());
    }
    let calibration = match &matched.calibration {
        None => None,
        Some(hash) => match read_calibration(sequence)? {
            Some(found) if found.0.hash() == *hash => Some(found),
            _ => return Err(ResultsMismatch::OtherCalibration(sequence_folder).into()),
        },
    };
    if matched.frames_blake3 != InputHashes::of(sequence).frames {
        return Err(ResultsMismatch::OtherFrames(sequence_folder).into());
    }
    let map = |map| files.needed_map(map);
    let (disparity, sigma) = rayon::join(|| map(ResultMap::Disparity), || map(ResultMap::Sigma));
    let (disparity, sigma) = (disparity?, sigma?);
    let (maps, record) = ((disparity.rows(), disparity.columns()), sequence.record());
    let frames = calibration.as_ref().map_or((record.rows, record.columns), |(calibration, _)| {
        (calibration.mapping.camera.rows, calibration.mapping.camera.columns)
    });
    if maps != frames {
        return Err(ResultsMismatch::FrameSize { results, maps, frames }.into());
    }
    let (reference, frames) = (matched.reference, sequence.frames().len());
    if reference >= frames {
        return Err(ResultsMismatch::Reference { results, reference, frames }.into());
    }
    let geometry = geometry(sequence, calibration.as_ref().map(|(calibration, _)| calibration));
    let found = geometry.and_then(|geometry| heights(geometry, &disparity, &sigma));
    if let Some(heights) = &found {
        // The same maps with the same geometry give the same distance, except for rounding in the record.
        let (told_mm, found_mm) = (matched.distance_mm.unwrap_or(f64::NAN), heights.distance_mm);
        let is_told = (told_mm - found_mm).abs() <= 1e-9 * found_mm.abs();
        if !is_told {
            return Err(ResultsMismatch::Distance { results, told_mm, found_mm }.into());
        }
    }
    let has_geometry = geometry.is_some();
    // The rig in records of another version may be unreadable; then nothing is compared.
    let rig = Profile::of_sequence(sequence).ok().flatten();
    let (asked, report) = rig.map(|rig| (rig.target.clone(), rig.report.clone())).unwrap_or_default();
    Ok(OpenedResults {
        files,
        matched,
        calibration,
        disparity,
        sigma,
        heights: found,
        has_geometry,
        planned_mm: asked.relief_mm,
        specification: asked.specification(),
        report,
    })
}
