//! The profile along a line, with its uncertainty.

use serde::Serialize;

use super::view::ResultsView;
use crate::panel::PanelError;
use crate::pipeline::profile_csv;
use epirig_server::{Query, Refusal};
use epirig_surface::{Line, Profile, profile};

use super::surface::heights;

/// Widest profile, in px, as for `epirig surface`.
const WIDEST_PX: usize = 1000;

#[derive(Serialize)]
pub(super) struct LineFacts {
    unit: &'static str,
    points: Vec<PointFacts>,
}

#[derive(Serialize)]
struct PointFacts {
    x_px: f64,
    y_px: f64,
    distance_mm: f64,
    height_mm: f64,
    sigma_mm: f64,
}

/// The profile that the query names by two ends and a width.
pub(super) fn line(view: &ResultsView, query: &Query) -> Result<LineFacts, Refusal> {
    let points = found(view, query)?.points.into_iter().map(|point| PointFacts {
        x_px: point.x_px,
        y_px: point.y_px,
        distance_mm: point.distance_mm,
        height_mm: point.height_mm,
        sigma_mm: point.sigma_mm,
    });
    Ok(LineFacts { unit: "mm", points: points.collect() })
}

/// The same as a table.
pub(super) fn csv(view: &ResultsView, query: &Query) -> Result<Vec<u8>, Refusal> {
    Ok(profile_csv(&found(view, query)?).into_bytes())
}

fn found(view: &ResultsView, query: &Query) -> Result<Profile, Refusal> {
    let heights = heights(view)?;
    let width_px: usize = query.value("width")?;
    if !(1..=WIDEST_PX).contains(&width_px) {
        return Err(
            PanelError::Wrong(format!("a profile is 1 to {WIDEST_PX} px wide, not {width_px}")).into()
        );
    }
    let line = Line {
        from_px: (query.value("x0")?, query.value("y0")?),
        to_px: (query.value("x1")?, query.value("y1")?),
        width_px,
    };
    // Heights as they are shown. Where the form was not removed, neighbours are taken to err together.
    let shown = view.maps.map("height").unwrap_or(&heights.height_mm);
    Ok(profile(heights, shown, line, f64::INFINITY).map_err(PanelError::from)?)
}
