//! The value of one pixel of what is shown: a map, or a frame.

use serde::Serialize;

use super::frames::FrameKind;
use super::levelled::shown_heights;
use super::pixel::{answer_at, sigma_at};
use super::view::ResultsView;
use crate::panel::PanelError;
use crate::panel::requests::requests;
use crate::results::reason;

requests! {
    /// A pixel of a map, or of a frame.
    ValueQuery {
        x: usize,
        y: usize,
        /// The map; a frame if there is one.
        #[serde(default)]
        map: String,
        frame: Option<usize>,
        kind: Option<FrameKind>,
        /// By what a map of heights is levelled, as in `LevelledQuery`.
        levelled_by: Option<String>,
    }
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
    let frame = asked.frame.map(|t| view.frames.picture_of(t, asked.kind)).transpose()?;
    let id = asked.map.as_str();
    let levelled = asked.levelled_by.as_deref().map(|by| shown_heights(view, id, Some(by))).transpose()?;
    let map = match (&frame, &levelled) {
        (Some(frame), _) => frame.map(),
        (None, Some(levelled)) => levelled,
        (None, None) => {
            view.maps.map(id).ok_or_else(|| PanelError::NotThere(format!("there is no map \"{id}\"")))?
        }
    };
    let (rows, columns) = (map.rows(), map.columns());
    if x >= columns || y >= rows {
        let words = format!("there is no pixel ({x}, {y}) in {columns} x {rows} px");
        return Err(PanelError::NotThere(words));
    }
    let value = Some(f64::from(map.at(x, y))).filter(|value| value.is_finite());
    if frame.is_some() {
        return Ok(OneValue { value, sigma: None, reason: None });
    }
    let sigma = sigma_at(view, id, x, y).filter(|_| value.is_some());
    let reason = value.is_none().then(|| reason(answer_at(view, x, y)));
    Ok(OneValue { value, sigma, reason })
}
