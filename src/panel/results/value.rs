//! The value of one pixel of what is shown: a map, or a frame.

use serde::{Deserialize, Serialize};

use super::frames::FrameKind;
use super::pixel::{answer_at, sigma_at};
use super::view::ResultsView;
use crate::panel::PanelError;
use crate::results::reason;

/// A pixel of a map, or of a frame.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct ValueQuery {
    x: usize,
    y: usize,
    /// The map; a frame if there is one.
    #[serde(default)]
    map: String,
    frame: Option<usize>,
    kind: Option<FrameKind>,
}

/// The value of one pixel.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct OneValue {
    /// `None` if the pixel has none.
    value: Option<f64>,
    /// Its standard uncertainty, if there is a map of it.
    sigma: Option<f64>,
    /// Why a map has no value here.
    reason: Option<String>,
}

/// The value of that pixel, at full resolution.
pub(super) fn value(view: &ResultsView, asked: &ValueQuery) -> Result<OneValue, PanelError> {
    let (x, y) = (asked.x, asked.y);
    let outside = |rows, columns| {
        let words = format!("there is no pixel ({x}, {y}) in {columns} x {rows} px");
        Err(PanelError::NotThere(words))
    };
    if let Some(t) = asked.frame {
        let frame = view.frames.picture_of(t, asked.kind)?;
        let grid = frame.map();
        if x >= grid.columns() || y >= grid.rows() {
            return outside(grid.rows(), grid.columns());
        }
        let value = Some(f64::from(grid.at(x, y))).filter(|value| value.is_finite());
        return Ok(OneValue { value, sigma: None, reason: None });
    }
    let id = asked.map.as_str();
    let map = view.maps.map(id).ok_or_else(|| PanelError::NotThere(format!("there is no map \"{id}\"")))?;
    if x >= map.columns() || y >= map.rows() {
        return outside(map.rows(), map.columns());
    }
    let value = Some(f64::from(map.at(x, y))).filter(|value| value.is_finite());
    let sigma = sigma_at(view, id, x, y).filter(|_| value.is_some());
    let reason = value.is_none().then(|| reason(answer_at(view, x, y)));
    Ok(OneValue { value, sigma, reason })
}
