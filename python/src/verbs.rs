//! The verbs of the command line, and the command itself.

use std::ffi::OsString;

use epirig::cli::embedded;
use pyo3::prelude::*;

use crate::work::done;

/// Runs a verb with its options; gives the record that `--json` prints, as text.
#[pyfunction]
#[pyo3(signature = (words, progress=None))]
pub(crate) fn call(
    py: Python<'_>,
    words: Vec<OsString>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<String> {
    let found = done(py, progress, |told| embedded::call(words, told))?;
    Ok(found.to_string())
}

/// All verbs with their options, as text (JSON).
#[pyfunction]
pub(crate) fn verbs() -> String {
    embedded::verbs().to_string()
}

/// The program `epirig`, with these arguments; gives its exit code.
#[pyfunction]
pub(crate) fn run(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| epirig::cli::run(arguments))
}
