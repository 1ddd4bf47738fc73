//! The stage axis from the target on the object.

use epirig_core::statistics::upper_median;
use rayon::prelude::*;

use super::boards::{MOST_BLUR_PX, refuse_other_size};
use super::remarks::Remarks;
use super::{CalibrateError, StageAxisRecord};
use epirig_calibration::lens::LensEstimate;
use epirig_calibration::rectification::RectifiedCamera;
use epirig_calibration::stage_axis::{StageAxis, baseline_by_target, find, outlines};
use epirig_calibration::target::{FoundBoard, Target, Tracks, find_boards, track};
use epirig_core::progress::Progress;
use epirig_data::sequence::Sequence;

/// The tracks of the target and their results.
pub(super) struct FoundAxis {
    pub(super) stage_axis: StageAxis,
    tracks: Tracks,
    corners_of_target: usize,
    /// Blur of the target's edges, in px.
    blur_px: Option<f64>,
    /// Length of the baseline from the size of the squares, in mm.
    pub(super) baseline_by_target_mm: Option<f64>,
}

pub(super) fn find_axis(
    sequence: &Sequence,
    target: &Target,
    lens: &LensEstimate,
    remarks: &mut Remarks,
    progress: &dyn Progress,
) -> Result<FoundAxis, CalibrateError> {
    target.check()?;
    let records = sequence.frames();
    progress.begin("following the target", records.len() as u64);
    let found: Result<Vec<Vec<FoundBoard>>, CalibrateError> = records
        .par_iter()
        .map(|record| {
            progress.unless_cancelled()?;
            let found = find_boards(&sequence.read(record)?, &target.board, target.bands);
            progress.advance(1);
            Ok(found)
        })
        .collect();
    let found = found?;
    progress.end();
    let blur_px = blur_in(&found)?;
    let size = (sequence.record().rows, sequence.record().columns);
    refuse_other_size("target", found.iter().flatten(), &target.board, size)?;
    let reported_mm = sequence.positions_mm();
    let tracks = track(&found, target, reported_mm.as_deref())?;
    let moved_px = longest_px(&tracks);
    if moved_px < LEAST_MOTION_PX {
        return Err(CalibrateError::StandsStill { moved_px });
    }
    let positions = reported_mm.unwrap_or_else(|| (0..records.len()).map(|index| index as f64).collect());
    // Frames at one position, or two in the wrong order, give no baseline.
    epirig_core::tau::Tau::from_positions(&positions)?;
    let stage_axis = find(&tracks, &positions, lens)?;
    let unseen = stage_axis.tau.iter().filter(|tau| tau.is_none()).count();
    if unseen > 0 {
        remarks.notes.push(format!(
            "{unseen} of {} frames show too little of the target; their positions are those that the stage reported",
            records.len()
        ));
    }
    let baseline_by_target_mm = baseline_by_target(&stage_axis.points, &tracks, target);
    let corners_of_target = target.bands * target.board.corners();
    Ok(FoundAxis { stage_axis, tracks, corners_of_target, blur_px, baseline_by_target_mm })
}

/// Least motion of the target over the scan, in px. With a smaller motion, the error of a corner (a hundredth
/// of a pixel) would be more than a percent of the motion.
const LEAST_MOTION_PX: f64 = 1.0;

/// Longest diagonal of the range of a corner, in px.
fn longest_px(tracks: &Tracks) -> f64 {
    let mut reach =
        vec![[f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY]; tracks.corners.len()];
    for seen in &tracks.observations {
        let [left, right, top, bottom] = reach[seen.corner];
        reach[seen.corner] =
            [left.min(seen.x_px), right.max(seen.x_px), top.min(seen.y_px), bottom.max(seen.y_px)];
    }
    reach
        .iter()
        .map(|[left, right, top, bottom]| (right - left).hypot(bottom - top))
        .filter(|px| px.is_finite())
        .fold(0.0, f64::max)
}

/// The median blur of the boards, in px; an error if they cannot be measured.
fn blur_in(found: &[Vec<FoundBoard>]) -> Result<Option<f64>, CalibrateError> {
    let mut blur: Vec<f64> = found.iter().flatten().map(|board| board.blur_px).collect();
    match upper_median(&mut blur) {
        Some(blur_px) if blur_px > MOST_BLUR_PX => {
            Err(CalibrateError::TargetBlurred { blur_px, limit_px: MOST_BLUR_PX })
        }
        blur_px => Ok(blur_px),
    }
}

impl FoundAxis {
    /// The record, for this rectified camera.
    pub(super) fn record(&self, camera: RectifiedCamera) -> StageAxisRecord {
        let focal_length_px = camera.focal_length_px;
        let stage_axis = &self.stage_axis;
        let mut disparities: Vec<f64> =
            stage_axis.points.iter().map(|point| focal_length_px * point.disparity).collect();
        let mut sigmas: Vec<f64> = self.tracks.observations.iter().map(|seen| seen.sigma_px).collect();
        StageAxisRecord {
            direction: stage_axis.direction,
            roll_deg: stage_axis.direction.roll_rad.to_degrees(),
            roll_sigma_deg: stage_axis.roll_sigma_rad.to_degrees(),
            pan_deg: stage_axis.direction.pan_rad.to_degrees(),
            pan_sigma_deg: stage_axis.pan_sigma_rad.to_degrees(),
            rows_rms_px: stage_axis.rows_rms_px(),
            corner_sigma_px: stage_axis.noise_factor * upper_median(&mut sigmas).unwrap_or(f64::NAN),
            blur_px: self.blur_px,
            corners: stage_axis.points.len(),
            corners_of_target: self.corners_of_target,
            observations: stage_axis.residuals.len(),
            rejected: stage_axis.rejected.clone(),
            frames: stage_axis.tau.iter().flatten().count(),
            disparity_px: upper_median(&mut disparities).unwrap_or(f64::NAN),
            target: outlines(
                &stage_axis.points,
                &self.tracks,
                focal_length_px,
                (camera.principal_point_x_px, camera.principal_point_y_px),
            ),
        }
    }
}
