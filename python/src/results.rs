//! Maps of results, from their files.

use std::path::PathBuf;

use epirig::cli::embedded::Refusal;
use epirig::results::{ResultFiles, ResultMap};
use epirig_core::choice::Choice as _;
use pyo3::prelude::*;

use crate::matching::{Map, array};
use crate::work::done;

/// The map `name` of the results in `folder`; `None` if they do not have it. What `epirig export` calls it.
#[pyfunction]
pub(crate) fn result_map<'py>(
    py: Python<'py>,
    folder: PathBuf,
    name: &str,
) -> PyResult<Option<Map<'py, f32>>> {
    let Some(map) = ResultMap::from_name(name) else { return Ok(None) };
    let found = done(py, None, |_| {
        let files = ResultFiles::open(&folder, map.row().kind).map_err(Refusal::of)?;
        files.map(map).map_err(Refusal::of)
    })?;
    found.map(|map| array(py, map)).transpose()
}

/// The maps of the results of `match`, `surface` or `compare`, each with its title and unit.
#[pyfunction]
pub(crate) fn map_names(verb: &str) -> Vec<(&'static str, &'static str, &'static str)> {
    let rows = ResultMap::ALL.iter().map(|map| map.row()).filter(|row| row.kind.verb() == verb);
    rows.map(|row| (row.id, row.title, row.unit())).collect()
}
