//! Stub.
use super::{Figure, ReportError};
/// Stub.
pub fn calibration_figures(_: &crate::calibrate::Calibrated) -> Result<Vec<Figure>, ReportError> {
    Ok(Vec::new())
}
