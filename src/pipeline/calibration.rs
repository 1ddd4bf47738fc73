//! Calibrates a sequence, with pictures.

use std::io::Cursor;

use super::PipelineError;
use crate::calibrate::{CalibrateError, Calibrated, CalibrationFolder, CalibrationPlan, calibrate};
use crate::report::calibration_figures;
use epirig_core::progress::Progress;
use epirig_data::sequence::Sequence;

/// Calibrates `sequence` and writes `calibration.json`, with pictures and their data in `calibration/`. The second
/// value is what failed when the calibration was in place: a picture that is missing, or a file that is left over.
///
/// # Errors
/// [`PipelineError`]; nothing is written if the frames are rejected.
pub fn calibrate_sequence(
    sequence: &Sequence,
    plan: &CalibrationPlan,
    overwrite: bool,
    progress: &dyn Progress,
) -> Result<(Calibrated, Option<CalibrateError>), PipelineError> {
    let mut folder = CalibrationFolder::of(sequence.folder(), overwrite)?;
    let mut found = calibrate(sequence, plan, progress)?;
    for figure in calibration_figures(&found)? {
        let name = format!("{}.png", figure.name);
        let mut bytes = Cursor::new(Vec::new());
        let written = figure.picture.write_to(&mut bytes, image::ImageFormat::Png);
        written.map_err(|error| CalibrateError::Io {
            action: "encode",
            path: folder.pictures().join(&name),
            source: std::io::Error::other(error),
        })?;
        folder.write(&name, bytes.get_ref())?;
        folder.write(&format!("{}.csv", figure.name), figure.csv.as_bytes())?;
    }
    let unfinished = folder.commit(&mut found.calibration, &found.maps)?;
    Ok((found, unfinished))
}
