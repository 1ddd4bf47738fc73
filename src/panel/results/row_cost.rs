//! The costs of a row with the mapping in them: the paper's figure 3b.

use serde::Serialize;

use super::view::ResultsView;
use crate::panel::PanelError;
use epirig_matcher::{DisparityRange, Matcher};
use epirig_server::{Refusal, Reply};

#[derive(Serialize)]
struct RowCost<'a> {
    rows: usize,
    columns: usize,
    y: usize,
    first_px: f64,
    step_px: f64,
    mapping: &'a [f32],
}

/// Costs of all candidates of row `y`: candidates x columns.
pub(super) fn row_cost(view: &ResultsView, y: usize) -> Result<Reply, Refusal> {
    let opened = view.results()?;
    let rows = opened.disparity.rows();
    if y >= rows {
        return Err(PanelError::NotThere(format!("there is no row {y}; the last is {}", rows - 1)).into());
    }
    let matched = &opened.matched;
    let reach = matched.settings.window_px / 2;
    let top = y.saturating_sub(reach);
    let volume = view.epis.rows(top..y + reach + 1)?;
    let matcher = Matcher::new(volume, matched.options()).map_err(PanelError::from)?;
    let range = DisparityRange { minimum_px: matched.minimum_px, maximum_px: matched.maximum_px };
    let (candidates, costs) =
        matcher.costs_of_row(y - top, matched.reference, range, matched.ordering_constraint);
    let record = RowCost {
        rows: costs.candidates(),
        columns: costs.columns(),
        y,
        first_px: candidates.disparity_px(0.0),
        step_px: candidates.disparity_step_px(),
        mapping: opened.disparity.row(y),
    };
    let values: Vec<f32> = (0..costs.candidates()).flat_map(|k| costs.row(k).iter().copied()).collect();
    Reply::framed(&record, &values)
}
