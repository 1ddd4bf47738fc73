//! Pictures of a calibration, to check it by eye.

mod brightness;
mod cells;
mod lens;
mod stage_axis;
#[cfg(test)]
pub(super) mod tests;

use super::{Figure, ReportError};
use crate::calibrate::Calibrated;

/// The figures of a calibration, for all parts that were calibrated.
///
/// - `flat-field`: relative gain over the frame, in %.
/// - `flat-field-residuals`: residuals of its model in the cells, in %.
/// - `frame-gains`: brightness of every frame, in %, with standard uncertainty.
/// - `lens-residuals`: observed minus predicted corners of the board, magnified.
/// - `lens-coverage`: number of corners in each of 10 x 10 cells.
/// - `rows`: distance of every corner of the target from its row after rectification, in px.
/// - `positioning-error`: measured minus reported position of every frame, in um.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn.
pub fn calibration_figures(found: &Calibrated) -> Result<Vec<Figure>, ReportError> {
    let calibration = &found.calibration;
    let mut figures = Vec::new();
    if let Some(field) = calibration.photometry.flat_field.applied() {
        figures.extend(brightness::flat_field(field, &found.maps)?);
        let size = (calibration.photometry.rows, calibration.photometry.columns);
        figures.extend(brightness::flat_field_residuals(field, size)?);
    }
    if let Some(gains) = calibration.frame_gains.applied() {
        figures.extend(brightness::frame_gains(gains)?);
    }
    if let Some(lens) = &calibration.lens.board_frames {
        figures.extend(lens::residuals(lens)?);
        figures.extend(lens::coverage(lens)?);
    }
    if let Some(stage_axis) = &found.stage_axis {
        figures.extend(stage_axis::rows(stage_axis, calibration)?);
    }
    if let Some(positioning) = &calibration.positions.positioning_error {
        figures.extend(stage_axis::positioning_error(positioning)?);
    }
    Ok(figures)
}
