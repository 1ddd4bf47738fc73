//! Heights for a view in three dimensions.

use serde::Serialize;

use super::levelled::shown_heights;
use super::surface::heights;
use super::view::ResultsView;
use crate::panel::PanelError;
use crate::panel::questions::Framed;
use crate::panel::requests::requests;
use epirig_core::grid::Grid;
use epirig_core::image::reduced_known;

requests! {
    /// Heights in three dimensions, of so many points at most.
    MeshQuery {
        most: usize,
        /// The map of heights.
        map: String,
        /// By what they are levelled, as in `LevelledQuery`.
        levelled_by: Option<String>,
    }
}

/// Most points that are sent.
const MOST: usize = 1_000_000;

/// What stands before the heights.
#[derive(Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(super) struct MeshInfo {
    rows: usize,
    columns: usize,
    step: usize,
    pixel_mm: f64,
    low_mm: f32,
    high_mm: f32,
    distance_mm: f64,
}

/// Heights, then the reference frame as brightness from 0 to 1: means of blocks, so that there are at most
/// `most` points are asked for.
pub(super) fn mesh(view: &ResultsView, asked: &MeshQuery) -> Result<Framed<MeshInfo>, PanelError> {
    let heights = heights(view)?;
    let map = shown_heights(view, &asked.map, asked.levelled_by.as_deref())?;
    let step = blocks_for(&map, asked.most);
    let shown = means(&map, step);
    let reference = view.frames.as_matched(view.results()?.matched.reference)?;
    let photograph = means(reference.map(), step);
    let brightest = photograph.values().iter().copied().fold(0.0, f32::max);
    let known = || shown.values().iter().copied().filter(|value| value.is_finite());
    let facts = MeshInfo {
        rows: shown.rows(),
        columns: shown.columns(),
        step,
        pixel_mm: heights.pixel_mm(),
        low_mm: known().fold(f32::INFINITY, f32::min),
        high_mm: known().fold(f32::NEG_INFINITY, f32::max),
        distance_mm: heights.distance_mm,
    };
    let mut values = shown.values().to_vec();
    // A frame without light has no brightest place, and stays black.
    let light = if brightest > 0.0 { brightest } else { f32::INFINITY };
    values.extend(photograph.values().iter().map(|value| (value / light).clamp(0.0, 1.0)));
    Ok(Framed(facts, values))
}

/// Side of blocks of which there are at most `most`.
pub(super) fn blocks_for<T: Copy>(map: &Grid<T>, most: usize) -> usize {
    let most = most.clamp(1, MOST);
    let pixels = map.rows() * map.columns();
    (1..).find(|step| pixels / (step * step) <= most).unwrap_or(1)
}

/// Means of the known values of blocks of `step` x `step` px; blocks that do not fit at the edges are left
/// out.
pub(super) fn means(map: &Grid<f32>, step: usize) -> Grid<f32> {
    let whole = |size: usize| 0..if size < step { size } else { size - size % step };
    reduced_known(&map.cropped(whole(map.columns()), whole(map.rows())), step, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_as_large_as_they_must_be() {
        let map = Grid::filled(1000, 2000, 1.0_f32);
        assert_eq!(blocks_for(&map, 2_000_000), 2); // a million at most
        assert_eq!(blocks_for(&map, 500_000), 2);
        assert_eq!(blocks_for(&map, 499_999), 3);
        let mut map = Grid::filled(4, 5, 2.0_f32);
        map.row_mut(0)[0] = f32::NAN;
        map.row_mut(0)[1] = 5.0;
        let found = means(&map, 2);
        assert_eq!((found.rows(), found.columns(), found.at(0, 0), found.at(1, 1)), (2, 2, 3.0, 2.0));
    }
}
