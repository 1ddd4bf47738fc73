//! What the simulator knows of a scan.

use std::path::PathBuf;

use epirig::calibrate::read_calibration;
use epirig::cli::embedded::Refusal;
use epirig::rig::scan_truth;
use epirig_data::sequence::Sequence;
use pyo3::prelude::*;

use crate::matching::{Map, array};
use crate::work::done;

/// True disparity in px and height in mm, the index of the reference frame, and the true positions in mm and on the
/// baseline.
type Known<'py> = (Map<'py, f32>, Map<'py, f32>, usize, Vec<f64>, Vec<f64>);

/// The truth of the simulated scan in `folder` for the pixels of frame `reference`, or of the middle one.
#[pyfunction]
#[pyo3(signature = (folder, reference))]
pub(crate) fn sequence_truth<'py>(
    py: Python<'py>,
    folder: PathBuf,
    reference: Option<usize>,
) -> PyResult<Known<'py>> {
    let truth = done(py, None, |_| {
        let sequence = Sequence::open(&folder).map_err(Refusal::of)?;
        let calibration =
            read_calibration(&sequence).map_err(Refusal::of)?.map(|(calibration, _)| calibration);
        scan_truth(&sequence, calibration.as_ref(), reference).map_err(Refusal::of)
    })?;
    let (disparity, height_mm) = (array(py, truth.maps.disparity)?, array(py, truth.maps.height_mm)?);
    Ok((disparity, height_mm, truth.reference, truth.positions_mm, truth.tau))
}
