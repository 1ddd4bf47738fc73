//! Exceptions: what the command line says and exits with, as an object.

use epirig::cli::embedded::Refusal;
use epirig_core::fault::Blame;
use pyo3::prelude::*;
use pyo3::types::IntoPyDict as _;

/// The exception of a failure; the classes and their attributes are those of `epirig/_errors.py`.
pub(crate) fn exception(py: Python<'_>, refusal: Refusal) -> PyErr {
    made(py, refusal, false)
}

/// The exception of work that Ctrl-C has ended.
pub(crate) fn interruption(py: Python<'_>, refusal: Refusal) -> PyErr {
    made(py, refusal, true)
}

fn made(py: Python<'_>, refusal: Refusal, by_ctrl_c: bool) -> PyErr {
    let Refusal { message, exit_code, kind, report } = refusal;
    let made = || -> PyResult<Bound<'_, PyAny>> {
        let facts = [("report", report.map(|report| report.to_string()))].into_py_dict(py)?;
        facts.set_item("by_ctrl_c", by_ctrl_c)?;
        let make = py.import("epirig._errors")?.getattr("of_failure")?;
        make.call((message, exit_code, kind), Some(&facts))
    };
    made().map_or_else(|error| error, PyErr::from_value)
}

/// Data that the library would not take either.
pub(crate) fn data(py: Python<'_>, message: String) -> PyErr {
    exception(py, Refusal::new(Blame::Data, message))
}
