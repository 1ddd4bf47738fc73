//! `match_array`: frames in memory in, maps out.

use std::ffi::OsString;

use epirig::cli::embedded::{Refusal, match_options, refuse_large_match};
use epirig::results::{ANSWER_CLASSES, class_of};
use epirig_core::grid::Grid;
use epirig_matcher::{Blocks, DisparityMaps, Matcher};
use numpy::{Element, IntoPyArray as _, PyArray2, PyArrayMethods as _, PyReadonlyArray2};
use pyo3::prelude::*;
use serde_json::json;

use crate::arrays::Frames;
use crate::errors::{data, exception};
use crate::work::done;

/// A map of rows x columns.
pub(crate) type Map<'py, T> = Bound<'py, PyArray2<T>>;

/// What a match gives: disparity, sigma, cost, confidence and validity, and the settings as JSON.
type Matched<'py> = (Map<'py, f32>, Map<'py, f32>, Map<'py, f32>, Map<'py, f32>, Map<'py, u8>, String);

/// The maps of `frames`, with the options `words` of `epirig match`; `mask` is not 0 where pixels are asked for.
#[pyfunction]
#[pyo3(signature = (frames, words, tau=None, mask=None, progress=None))]
pub(crate) fn match_array<'py>(
    py: Python<'py>,
    frames: Bound<'py, PyAny>,
    words: Vec<OsString>,
    tau: Option<Vec<f64>>,
    mask: Option<PyReadonlyArray2<'py, u8>>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Matched<'py>> {
    let options = match_options(words).map_err(|refusal| exception(py, refusal))?;
    let frames = Frames::of(frames)?;
    refuse_large_match(frames.size()?, &options).map_err(|refusal| exception(py, refusal))?;
    let stack = frames.stack()?;
    let stack = match tau {
        Some(tau) => stack.at(&tau).map_err(|error| data(py, error.to_string()))?,
        None => stack,
    };
    let inside = mask.map(|mask| {
        let size = mask.as_array().dim();
        (size, mask.as_array().iter().map(|&inside| inside != 0).collect::<Vec<bool>>())
    });
    let inside = inside.and_then(|((rows, columns), values)| Grid::from_values(rows, columns, values));
    let used = options.clone();
    let maps: DisparityMaps = done(py, progress, |told| {
        let volume = stack.into_volume();
        let blocks = Blocks::new(&volume.shape(), options).map_err(Refusal::of)?;
        let blocks = match &inside {
            Some(inside) => blocks.within(inside).map_err(Refusal::of)?,
            None => blocks,
        };
        Matcher::of_blocks(volume, blocks).matched(&*told).map_err(Refusal::of)
    })?;
    let facts = json!({
        "settings": used,
        "reference": maps.reference,
        "minimum_px": maps.range.minimum_px,
        "maximum_px": maps.range.maximum_px,
        "range_found": maps.range_found,
        "ordering_constraint": maps.ordering,
    });
    let validity = maps.validity.map(|validity| class_of(validity).value);
    Ok((
        array(py, maps.disparity)?,
        array(py, maps.sigma)?,
        array(py, maps.cost)?,
        array(py, maps.confidence)?,
        array(py, validity)?,
        facts.to_string(),
    ))
}

/// An array that owns the values of `map`.
pub(crate) fn array<T: Element>(py: Python<'_>, map: Grid<T>) -> PyResult<Map<'_, T>> {
    let size = [map.rows(), map.columns()];
    map.into_values().into_pyarray(py).reshape(size)
}

/// The values of `validity`, with their names.
#[pyfunction]
pub(crate) fn validity_classes() -> Vec<(u8, &'static str)> {
    ANSWER_CLASSES.iter().map(|class| (class.value, class.name)).collect()
}
