//! Pictures of a calibration, for a person who wants to see before believing.

mod brightness;
mod cells;
mod lens;
mod stage_axis;
#[cfg(test)]
mod tests;

use super::{Figure, ReportError};
use crate::calibrate::Calibrated;

/// The figures of a calibration; those of parts that were not found are left out.
///
/// - `flat-field`: relative gain over the frame, in %.
/// - `flat-field-residuals`: what its model leaves of the cells, in %.
/// - `frame-gains`: brightness of every frame, in %, with standard deviation.
/// - `lens-residuals`: corners of the board where they were seen less where they are predicted, magnified.
/// - `lens-coverage`: how many corners lie in each of 10 x 10 cells.
/// - `rows`: distance of every corner of the target from its row after rectification, in px.
/// - `positioning-error`: measured less reported position of every frame, in um.
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
