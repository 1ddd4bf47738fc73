//! Height maps less a plane, by which the page levels them. Nothing of it is written.

use std::ops::Deref;
use std::sync::Arc;

use serde::Serialize;

use super::levelled_maps::Levelled;
use super::pyramid::{Place, Pyramid, Reduction};
use super::statistics::Statistics;
use super::surface::{heights, region_of};
use super::view::ResultsView;
use crate::panel::PanelError;
use crate::panel::requests::requests;
use epirig_core::grid::Grid;
use epirig_surface::{Heights, Plane, Rectangle};

/// The maps that are levelled.
const HEIGHTS: [&str; 2] = ["height", "height-measured"];

requests! {
    /// Which levelled map is asked for.
    LevelledQuery {
        map: String,
        levelled_by: String,
    }
}

/// What is known of a levelled map.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct LevelledInfo {
    /// Tilt that was taken away, in mrad; positive where the right or the lower side is nearer to the camera.
    tilt_x_mrad: f64,
    tilt_y_mrad: f64,
    #[serde(flatten)]
    statistics: Statistics,
}

/// What the page is told of a levelled map.
pub(super) fn levelled(view: &ResultsView, asked: &LevelledQuery) -> Result<LevelledInfo, PanelError> {
    let found = levelled_map(view, &asked.map, &asked.levelled_by)?;
    let (tilt_x_mrad, tilt_y_mrad) = tilt_mrad(&found.plane);
    Ok(LevelledInfo { tilt_x_mrad, tilt_y_mrad, statistics: Statistics::of(found.pyramid.map()) })
}

/// Angles of a plane along x and along y, in mrad.
pub(super) fn tilt_mrad(plane: &Plane) -> (f64, f64) {
    let angle = |slope: f64| 1e3 * slope.atan();
    (angle(plane.slopes.0), angle(plane.slopes.1))
}

/// The map `map`, levelled by what the page says.
fn levelled_map(view: &ResultsView, map: &str, by: &str) -> Result<Arc<Levelled>, PanelError> {
    view.levelled.get(map, by, || {
        let heights = heights(view)?;
        let shown = plain(view, heights, map)?;
        let plane = LevelledBy::read(by, shown)?.plane(heights, shown)?;
        Ok((plane, Pyramid::new(plane.removed_from(heights, shown), Reduction::Mean)))
    })
}

/// Heights as they are shown.
pub(super) enum ShownHeights<'a> {
    Plain(&'a Grid<f32>),
    Levelled(Arc<Levelled>),
}

impl Deref for ShownHeights<'_> {
    type Target = Grid<f32>;

    fn deref(&self) -> &Grid<f32> {
        match self {
            Self::Plain(map) => map,
            Self::Levelled(levelled) => levelled.pyramid.map(),
        }
    }
}

/// The heights of the map `map`, levelled if the page says by what.
pub(super) fn shown_heights<'a>(
    view: &'a ResultsView,
    map: &str,
    by: Option<&str>,
) -> Result<ShownHeights<'a>, PanelError> {
    match by {
        Some(by) => Ok(ShownHeights::Levelled(levelled_map(view, map, by)?)),
        None => Ok(ShownHeights::Plain(plain(view, heights(view)?, map)?)),
    }
}

/// Whether a map is one of heights, which can be levelled.
pub(super) fn is_levelled(map: &str) -> bool {
    HEIGHTS.contains(&map)
}

/// A tile of a levelled map.
pub(super) fn levelled_tile(
    view: &ResultsView,
    map: &str,
    by: &str,
    place: Place,
) -> Result<Vec<f32>, PanelError> {
    levelled_map(view, map, by)?.pyramid.tile(place)
}

fn plain<'a>(view: &'a ResultsView, heights: &'a Heights, map: &str) -> Result<&'a Grid<f32>, PanelError> {
    if !is_levelled(map) {
        return Err(PanelError::NotThere(format!("the map \"{map}\" shows no heights")));
    }
    Ok(view.maps.map(map).unwrap_or(&heights.height_mm))
}

/// By what a map is levelled.
#[derive(Debug, Clone, Copy, PartialEq)]
enum LevelledBy {
    /// The least-squares plane of a region.
    Region(Rectangle),
    /// The plane through three points: columns and rows.
    Points([(usize, usize); 3]),
}

impl LevelledBy {
    /// As the page writes it: `region-x0-y0-x1-y1` with corners as in other questions, or `points-x-y-x-y-x-y`.
    fn read(text: &str, map: &Grid<f32>) -> Result<Self, PanelError> {
        let wrong = || {
            let words = "region-x0-y0-x1-y1 or points-x-y-x-y-x-y in px";
            PanelError::Wrong(format!("a map is levelled by {words}, not by \"{text}\""))
        };
        let (kind, numbers) = text.split_once('-').ok_or_else(wrong)?;
        let numbers: Vec<usize> =
            numbers.split('-').map(str::parse).collect::<Result<_, _>>().map_err(|_| wrong())?;
        match (kind, numbers.as_slice()) {
            ("region", &[x0, y0, x1, y1]) => Ok(Self::Region(region_of([x0, y0, x1, y1], map)?)),
            ("points", &[x0, y0, x1, y1, x2, y2]) => Ok(Self::Points([(x0, y0), (x1, y1), (x2, y2)])),
            _ => Err(wrong()),
        }
    }

    fn plane(self, heights: &Heights, shown: &Grid<f32>) -> Result<Plane, PanelError> {
        Ok(match self {
            Self::Region(region) => Plane::least_squares(heights, shown, region)?,
            Self::Points(points) => Plane::through(heights, shown, points)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_map_is_levelled_by_is_read() {
        let map = Grid::filled(40, 50, 0.0_f32);
        let read = |text: &str| LevelledBy::read(text, &map).map_err(|error| error.to_string());
        let region = Rectangle { left: 1, top: 2, right: 49, bottom: 39 };
        assert_eq!(read("region-1-2-50-40"), Ok(LevelledBy::Region(region)));
        assert_eq!(read("points-1-2-3-4-5-6"), Ok(LevelledBy::Points([(1, 2), (3, 4), (5, 6)])));
        assert!(read("region-1-2-51-40").unwrap_err().contains("exceeds the picture of 50 x 40 px"));
        for text in ["", "region", "region-1-2-3", "points-1-2-3-4", "region-1-2-x-4", "plane-1-2-3-4"] {
            assert!(read(text).unwrap_err().starts_with("a map is levelled by region-x0"), "{text}");
        }
    }
}
