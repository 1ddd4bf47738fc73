//! The costs of a row with the mapping in them: the paper's figure 3b.

use serde::Serialize;

use super::view::ResultsView;
use crate::panel::PanelError;
use crate::panel::questions::Framed;
use epirig_matcher::{DisparityRange, Matcher};

/// The row that was asked for, and its costs' axes.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct RowCost {
    rows: usize,
    columns: usize,
    y: usize,
    first_px: f64,
    step_px: f64,
    #[cfg_attr(test, ts(as = "Vec<Option<f32>>"))]
    mapping: Vec<f32>,
}

/// Costs of all candidates of row `y`: candidates x columns.
pub(super) fn row_cost(view: &ResultsView, y: usize) -> Result<Framed<RowCost>, PanelError> {
    let opened = view.results()?;
    let rows = opened.disparity.rows();
    if y >= rows {
        return Err(PanelError::NotThere(format!("there is no row {y}; the last is {}", rows - 1)));
    }
    let matched = &opened.matched;
    let reach = matched.settings.window_px / 2;
    let top = y.saturating_sub(reach);
    let volume = view.epis.rows(top..y + reach + 1)?;
    let matcher = Matcher::new(volume, matched.options())?;
    let range = DisparityRange { minimum_px: matched.minimum_px, maximum_px: matched.maximum_px };
    let (candidates, costs) =
        matcher.costs_of_row(y - top, matched.reference, range, matched.ordering_constraint)?;
    let record = RowCost {
        rows: costs.candidates(),
        columns: costs.columns(),
        y,
        first_px: candidates.disparity_px(0.0),
        step_px: candidates.disparity_step_px(),
        mapping: opened.disparity.row(y).to_vec(),
    };
    let values: Vec<f32> = (0..costs.candidates()).flat_map(|k| costs.row(k).iter().copied()).collect();
    Ok(Framed(record, values))
}
