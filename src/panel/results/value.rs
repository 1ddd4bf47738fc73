//! The value of one pixel of what is shown: a map, or a frame.

use serde::Serialize;

use super::pixel::{answer_at, sigma_at};
use super::view::ResultsView;
use crate::panel::PanelError;
use crate::results::reason;
use epirig_server::{Query, Refusal};

#[derive(Serialize)]
pub(super) struct PixelValue {
    /// `None` if the pixel has none.
    value: Option<f64>,
    /// Its standard uncertainty, if there is a map of it.
    sigma: Option<f64>,
    /// Why a map has no value here.
    reason: Option<String>,
}

/// The value at `x` and `y` of the map `map`, or of the frame `frame` of the kind `kind`: of that pixel, at full
/// resolution.
pub(super) fn value(view: &ResultsView, query: &Query) -> Result<PixelValue, Refusal> {
    let (x, y) = (query.value("x")?, query.value("y")?);
    let outside = |rows, columns| {
        let words = format!("there is no pixel ({x}, {y}) in {columns} x {rows} px");
        Err(PanelError::NotThere(words).into())
    };
    if let Some(t) = query.text("frame") {
        let frame = view.frames.picture_of(t, query.text("kind"))?;
        let grid = frame.map();
        if x >= grid.columns() || y >= grid.rows() {
            return outside(grid.rows(), grid.columns());
        }
        let value = Some(f64::from(grid.at(x, y))).filter(|value| value.is_finite());
        return Ok(PixelValue { value, sigma: None, reason: None });
    }
    let id = query.text("map").unwrap_or_default();
    let map = view.maps.map(id).ok_or_else(|| PanelError::NotThere(format!("there is no map \"{id}\"")))?;
    if x >= map.columns() || y >= map.rows() {
        return outside(map.rows(), map.columns());
    }
    let value = Some(f64::from(map.at(x, y))).filter(|value| value.is_finite());
    let sigma = sigma_at(view, id, x, y).filter(|_| value.is_some());
    let reason = value.is_none().then(|| reason(answer_at(view, x, y)));
    Ok(PixelValue { value, sigma, reason })
}
