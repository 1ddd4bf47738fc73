//! The profile along a line, with its uncertainty.

use serde::Serialize;

use super::view::ResultsView;
use crate::panel::PanelError;
#[cfg(test)]
use crate::panel::page_type_tests;
use crate::panel::requests::requests;
use crate::pipeline::profile_csv;
use epirig_surface::{Profile, ProfileLine, ProfilePoint, profile};

use super::levelled::shown_heights;
use super::surface::heights;

/// Widest profile, in px, as for `epirig surface`.
const WIDEST_PX: usize = 1000;

requests! {
    /// Both ends of a line and its width, in px; by what the heights are levelled, as in `LevelledQuery`.
    LineEnds { x0: f64, y0: f64, x1: f64, y1: f64, width: usize, levelled_by: Option<String> }
}

/// A profile.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct LineInfo {
    #[cfg_attr(test, ts(type = "'mm'"))]
    unit: &'static str,
    #[cfg_attr(test, ts(as = "Vec<page_type_tests::LinePoint>"))]
    points: Vec<ProfilePoint>,
}

/// The profile between two ends.
pub(super) fn line(view: &ResultsView, ends: &LineEnds) -> Result<LineInfo, PanelError> {
    Ok(LineInfo { unit: "mm", points: found(view, ends)?.points })
}

/// The same as a table.
pub(super) fn csv(view: &ResultsView, ends: &LineEnds) -> Result<Vec<u8>, PanelError> {
    Ok(profile_csv(&found(view, ends)?).into_bytes())
}

fn found(view: &ResultsView, ends: &LineEnds) -> Result<Profile, PanelError> {
    let heights = heights(view)?;
    let &LineEnds { x0, y0, x1, y1, width: width_px, .. } = ends;
    if !(1..=WIDEST_PX).contains(&width_px) {
        return Err(PanelError::Wrong(format!("a profile is 1 to {WIDEST_PX} px wide, not {width_px}")));
    }
    let line = ProfileLine { from_px: (x0, y0), to_px: (x1, y1), width_px };
    // Heights as they are shown. Where the form was not removed, neighbours are taken to err together.
    let shown = shown_heights(view, "height", ends.levelled_by.as_deref())?;
    Ok(profile(heights, &shown, line, f64::INFINITY)?)
}
