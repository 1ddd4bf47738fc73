//! Questions about a region of the surface.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Serialize};

use super::view::ResultsView;
use crate::panel::PanelError;
use crate::pipeline::{SurfaceQuestions, analyse_surface, steps_options};
use crate::results::{Mask, Region, SurfaceSummary, parse_mask};
use epirig_core::choice::Choice as _;
use epirig_core::grid::Grid;
use epirig_surface::{Heights, Rectangle, TrendKind};

/// The part of the map that is asked about: a pixel must lie in both region and mask.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub(super) struct SurfaceQuestion {
    /// Which results are asked about; checked already.
    #[serde(default, rename = "of")]
    #[cfg_attr(test, ts(skip))]
    _of: Option<String>,
    /// Two corners, in px; `null` for the whole picture.
    region: Option<[usize; 4]>,
    /// Only pixels inside of this, too; `null` for all.
    mask: Option<MaskFile>,
    #[serde(default = "usual_trend")]
    #[cfg_attr(test, ts(as = "String"))]
    trend: TrendKind,
}

/// A picture whose white pixels are inside, as a file.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
struct MaskFile {
    name: String,
    /// The bytes of the file.
    base64: String,
}

fn usual_trend() -> TrendKind {
    TrendKind::Quadric
}

#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct Trend {
    name: &'static str,
    title: &'static str,
}

/// The forms that can be removed.
pub(super) fn trends() -> Vec<Trend> {
    TrendKind::ALL.iter().map(|kind| Trend { name: kind.name(), title: kind.help() }).collect()
}

/// Step height and roughness of a region, as `epirig surface` computes them; nothing is written.
pub(super) fn surface(view: &ResultsView, asked: SurfaceQuestion) -> Result<SurfaceSummary, PanelError> {
    let opened = view.results()?;
    let heights = heights(view)?;
    let rectangle = asked.region.map(|region| region_of(region, &heights.height_mm)).transpose()?;
    let (rows, columns) = (heights.height_mm.rows(), heights.height_mm.columns());
    let steps = steps_options(&opened.matched.settings, asked.trend);
    let mask = asked.mask.map(|mask| mask.read(rows, columns)).transpose()?;
    let region = Region { rectangle, mask }.checked(rows, columns)?;
    let questions = SurfaceQuestions { steps, region, ..SurfaceQuestions::usual(opened) };
    Ok(analyse_surface(heights, view.halves(), opened, &questions)?.summary)
}

impl MaskFile {
    /// The mask, for maps of `rows` x `columns`.
    fn read(&self, rows: usize, columns: usize) -> Result<Mask, PanelError> {
        let bytes = STANDARD.decode(&self.base64).map_err(|error| {
            PanelError::Wrong(format!("the question is not understood: the mask: {error}"))
        })?;
        Ok(parse_mask(&bytes, Path::new(&self.name), rows, columns)?)
    }
}

/// A region of `map` as the page has it: it ends before x1 and y1.
pub(super) fn region_of([x0, y0, x1, y1]: [usize; 4], map: &Grid<f32>) -> Result<Rectangle, PanelError> {
    let region = Rectangle::between((x0, y0), (x1.saturating_sub(1).max(x0), y1.saturating_sub(1).max(y0)));
    let (rows, columns) = (map.rows(), map.columns());
    if !region.fits(rows, columns) {
        return Err(PanelError::Wrong(format!("the region exceeds the picture of {columns} x {rows} px")));
    }
    Ok(region)
}

/// The heights, or why there are none.
pub(super) fn heights(view: &ResultsView) -> Result<&Heights, PanelError> {
    view.results()?.heights.as_ref().ok_or_else(|| {
        PanelError::NotThere(
            "there are no heights: focal length or positions are unknown; calibrate the sequence".to_owned(),
        )
    })
}
