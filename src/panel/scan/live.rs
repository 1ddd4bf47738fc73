//! The live map as it is sent to the page.

use serde::Serialize;

use crate::panel::error::PanelError;
use crate::panel::live_map::LiveMap;
use crate::panel::questions::Framed;

/// What stands before the values of a live map.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(in crate::panel) struct LiveMapHead {
    rows: usize,
    columns: usize,
    bin: usize,
    frames: usize,
    planned: usize,
    unit: &'static str,
    low: f64,
    high: f64,
}

/// Share of the values below and above the range that is shown. Beside the borders of an object a few columns
/// are wrong, and these must not decide the colours of all others.
const TAIL: f64 = 0.03;

/// The disparity or the sigma of `map`, with the range of most of its values.
pub(in crate::panel) fn live_map(map: &LiveMap, kind: &str) -> Result<Framed<LiveMapHead>, PanelError> {
    let grid = match kind {
        "disparity" => &map.disparity,
        "sigma" => &map.sigma,
        other => return Err(PanelError::NotThere(format!("there is no live map \"{other}\""))),
    };
    let mut known: Vec<f64> =
        grid.values().iter().filter(|value| value.is_finite()).map(|&value| f64::from(value)).collect();
    known.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let place = (share * known.len().saturating_sub(1) as f64).round() as usize;
        known.get(place).copied().unwrap_or(0.0)
    };
    let head = LiveMapHead {
        rows: grid.rows(),
        columns: grid.columns(),
        bin: map.bin,
        frames: map.frames,
        planned: map.planned,
        unit: "px",
        low: at(TAIL),
        high: at(1.0 - TAIL),
    };
    Ok(Framed(head, grid.values().to_vec()))
}
