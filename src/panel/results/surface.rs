//! Questions about a region of the surface.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::view::ResultsView;
use crate::panel::PanelError;
use crate::pipeline::{SurfaceQuestions, analyse_surface, steps_options};
use crate::results::{Region, SurfaceSummary};
use epirig_core::choice::Choice as _;
use epirig_matcher::surface::{Heights, Rectangle, TrendKind};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    /// Two corners, in px; `null` for the whole picture.
    region: Option<[usize; 4]>,
    #[serde(default = "usual_trend")]
    trend: TrendKind,
}

fn usual_trend() -> TrendKind {
    TrendKind::Quadric
}

#[derive(Serialize)]
pub(super) struct TrendFacts {
    name: &'static str,
    title: &'static str,
}

/// The forms that can be removed.
pub(super) fn trends() -> Vec<TrendFacts> {
    TrendKind::ALL.iter().map(|kind| TrendFacts { name: kind.name(), title: kind.help() }).collect()
}

/// Step height and roughness of a region, as `epirig surface` computes them; nothing is written.
pub(super) fn surface(view: &ResultsView, asked: &Value) -> Result<SurfaceSummary, PanelError> {
    let asked: Asked = serde_json::from_value(asked.clone())
        .map_err(|error| PanelError::Wrong(format!("the question is not understood: {error}")))?;
    let opened = view.results()?;
    let heights = heights(view)?;
    // The page's regions end before x1 and y1.
    let rectangle = asked.region.map(|[x0, y0, x1, y1]| {
        Rectangle::between((x0, y0), (x1.saturating_sub(1).max(x0), y1.saturating_sub(1).max(y0)))
    });
    let (rows, columns) = (heights.height_mm.rows(), heights.height_mm.columns());
    if rectangle.is_some_and(|rectangle| !rectangle.fits(rows, columns)) {
        return Err(PanelError::Wrong(format!("the region exceeds the picture of {columns} x {rows} px")));
    }
    let steps = steps_options(&opened.matched.settings, asked.trend);
    let region = Region { rectangle, mask: None };
    let questions = SurfaceQuestions { region, ..SurfaceQuestions::usual(steps) };
    Ok(analyse_surface(heights, view.halves(), opened, &questions)?.summary)
}

/// The heights, or why there are none.
pub(super) fn heights(view: &ResultsView) -> Result<&Heights, PanelError> {
    view.results()?.heights.as_ref().ok_or_else(|| {
        PanelError::NotThere(
            "there are no heights: focal length or positions are unknown; calibrate the sequence".to_owned(),
        )
    })
}
