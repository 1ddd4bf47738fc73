//! Positions from the object's texture, jointly with its disparity.

use super::{CalibrateError, PositionSource, PositionsRecord};
use epirig_calibration::stage_axis::{MeasuredTau, positioning_error};
use epirig_core::progress::{Progress, Silent};
use epirig_core::tau::Tau;
use epirig_core::volume::Volume;
use epirig_matcher::{DisparityRange, MatchOptions, ReferenceFrame, match_volume, tau_corrections};

/// Rows per block; they are adjacent, so that windows are complete.
const BLOCK_ROWS: usize = 8;
/// Blocks over the height of the image: about a hundred rows determine a position to a fraction of a um.
const BLOCKS: usize = 12;
/// Rounds of matching and correcting; for errors of the stage below one pixel two are enough.
const ROUNDS: usize = 6;

/// tau of every frame from the texture; scale and origin come from the stage (or from the frame count).
pub(super) fn from_texture(
    volume: &Volume,
    reported_mm: Option<&[f64]>,
    progress: &dyn Progress,
) -> Result<PositionsRecord, CalibrateError> {
    let texture = |reason: String| CalibrateError::Texture { reason };
    let frames: Vec<usize> = (0..volume.frames()).collect();
    let rows = rows(volume.rows());
    let mut options = MatchOptions { reference: ReferenceFrame::Middle, ..MatchOptions::default() };
    let mut tau = volume.tau().clone();
    progress.begin("positions from the texture", ROUNDS as u64);
    let mut measured: Vec<MeasuredTau> = Vec::new();
    for _ in 0..ROUNDS {
        let some = volume.selected(&rows, &frames, tau.clone());
        let maps = match_volume(&some, &options, &Silent).map_err(|error| texture(error.to_string()))?;
        // Errors of tau change no disparity by a pixel.
        options.range = Some(DisparityRange {
            minimum_px: maps.range.minimum_px - 1.0,
            maximum_px: maps.range.maximum_px + 1.0,
        });
        let corrections = tau_corrections(&some, &maps).map_err(|error| texture(error.to_string()))?;
        measured = tau
            .values()
            .iter()
            .zip(&corrections)
            .map(|(tau, found)| MeasuredTau { tau: tau + found.correction, sigma: found.sigma })
            .collect();
        let next: Vec<f64> = measured.iter().map(|measured| measured.tau).collect();
        tau = Tau::from_positions(&next)?;
        progress.advance(1);
        if corrections.iter().all(|found| found.correction.abs() < 0.1 * found.sigma) {
            break;
        }
    }
    progress.end();
    let counted: Vec<f64> = frames.iter().map(|&index| index as f64).collect();
    let measured: Vec<Option<MeasuredTau>> = measured.into_iter().map(Some).collect();
    let positioning = positioning_error(&measured, reported_mm.unwrap_or(&counted))
        .ok_or_else(|| texture("there are fewer than two frames".to_owned()))?;
    let positions: Vec<f64> = positioning.frames.iter().map(|frame| frame.measured_mm).collect();
    let span = positioning.baseline_mm;
    Ok(PositionsRecord {
        source: PositionSource::Texture,
        tau: Tau::from_positions(&positions)?.values().to_vec(),
        tau_sigma: positioning.frames.iter().map(|frame| frame.sigma_mm.map(|sigma| sigma / span)).collect(),
        baseline_mm: reported_mm.map(|_| span),
        baseline_sigma_mm: reported_mm.map(|_| positioning.baseline_sigma_mm),
        positioning_error: reported_mm.map(|_| positioning),
        target_scale: None,
    })
}

/// Blocks of rows, evenly over the image; all rows of a small image.
fn rows(height: usize) -> Vec<usize> {
    if height <= BLOCK_ROWS * BLOCKS {
        return (0..height).collect();
    }
    (0..BLOCKS)
        .flat_map(|block| {
            let first = block * (height - BLOCK_ROWS) / (BLOCKS - 1);
            first..first + BLOCK_ROWS
        })
        .collect()
}
