//! The part of a map that a picture shows, and how large.

use std::ops::Range;

use super::axes::Scale;
use epirig_core::grid::Grid;
use epirig_core::image::reduced_known;
use epirig_surface::{Geometry, Heights};

/// What is shown around the known pixels: this share of their longer side, from and up to so many px.
const MARGIN: usize = 25;
const MARGIN_PX: std::ops::RangeInclusive<usize> = 4..=16;

/// Where pixels lie in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Millimetres {
    /// Width of a pixel.
    pub pixel_mm: f64,
    /// Column and row where x and y are zero.
    pub origin_px: (f64, f64),
}

impl Millimetres {
    /// At the level from which `heights` are counted.
    pub fn of(heights: &Heights) -> Self {
        let Geometry { principal_point_x_px, principal_point_y_px, .. } = heights.geometry;
        Self { pixel_mm: heights.pixel_mm(), origin_px: (principal_point_x_px, principal_point_y_px) }
    }
}

/// Columns and rows of a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Window {
    /// The columns.
    pub columns: Range<usize>,
    /// The rows.
    pub rows: Range<usize>,
}

impl Window {
    /// The known values of `map` with a small margin; all of the map if nothing is known.
    pub fn around(map: &Grid<f32>) -> Self {
        let (columns, rows) = (map.columns(), map.rows());
        let known = |x: usize, y: usize| map.at(x, y).is_finite();
        let occupied = |size: usize, is: &dyn Fn(usize) -> bool| {
            let first = (0..size).find(|&index| is(index)).unwrap_or(0);
            let last = (0..size).rfind(|&index| is(index)).unwrap_or(size.saturating_sub(1));
            first..(last + 1).min(size)
        };
        let across = occupied(columns, &|x| (0..rows).any(|y| known(x, y)));
        let down = occupied(rows, &|y| (0..columns).any(|x| known(x, y)));
        let margin = across.len().max(down.len()) / MARGIN;
        let margin = margin.clamp(*MARGIN_PX.start(), *MARGIN_PX.end());
        let with_margin = |range: Range<usize>, size: usize| {
            range.start.saturating_sub(margin)..(range.end + margin).min(size)
        };
        Self { columns: with_margin(across, columns), rows: with_margin(down, rows) }
    }

    /// All of a map of this size.
    pub fn whole(rows: usize, columns: usize) -> Self {
        Self { columns: 0..columns, rows: 0..rows }
    }

    /// The part of `map` in it.
    ///
    /// # Panics
    /// If it reaches outside the map.
    pub fn of<T: Copy>(&self, map: &Grid<T>) -> Grid<T> {
        map.cropped(self.columns.clone(), self.rows.clone())
    }
}

/// Narrower pictures of maps are enlarged up to this side, unless the longer side gets [`LONG_PX`].
const COMFORTABLE_PX: usize = 400;
const LONG_PX: usize = 800;

/// How a map's pixels become those of a picture: by whole numbers, so that each pixel looks alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Zoom {
    /// Side of the square of map pixels whose mean is shown as one.
    pub(super) reduced: usize,
    /// Side of the square of picture pixels that shows it.
    pub(super) enlarged: usize,
}

impl Zoom {
    /// For a map whose picture may be `most_px` wide and high.
    pub(super) fn of(rows: usize, columns: usize, most_px: usize) -> Self {
        let (longer, shorter) = (rows.max(columns).max(1), rows.min(columns).max(1));
        let wanted = COMFORTABLE_PX.div_ceil(shorter).min(LONG_PX.min(most_px) / longer);
        Self { reduced: longer.div_ceil(most_px.max(1)).max(1), enlarged: wanted.max(1) }
    }

    /// Scales along x and y of a picture of this width and height: in mm if it is known where pixels lie, else in px.
    pub(super) fn scales(
        &self,
        window: &Window,
        (width, height): (u32, u32),
        millimetres: Option<Millimetres>,
    ) -> [Scale; 2] {
        let scale = self.enlarged as f64 / self.reduced as f64;
        let Millimetres { pixel_mm: unit, origin_px } =
            millimetres.unwrap_or(Millimetres { pixel_mm: 1.0, origin_px: (0.0, 0.0) });
        let along = |first: usize, length_px: u32, origin: f64| {
            // A map pixel reaches half a pixel to both sides of its column.
            let place = |pixel: f64| (first as f64 - 0.5 + (pixel + 0.5) / scale - origin) * unit;
            Scale { first: place(0.0), last: place(f64::from(length_px) - 1.0), length_px }
        };
        [along(window.columns.start, width, origin_px.0), along(window.rows.start, height, origin_px.1)]
    }
}

/// Means of the known values of `factor` x `factor` pixels; unknown where more than half of them are.
pub(in crate::report) fn reduced(map: &Grid<f32>, factor: usize) -> Grid<f32> {
    reduced_known(map, factor, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_is_that_of_the_known_values_and_a_margin() {
        let mut map = Grid::filled(60, 100, f32::NAN);
        assert_eq!(Window::around(&map), Window::whole(60, 100));
        (map.row_mut(20)[40], map.row_mut(22)[90]) = (1.0, 2.0);
        assert_eq!(Window::around(&map), Window { columns: 36..95, rows: 16..27 });
        assert_eq!(Window { columns: 39..42, rows: 20..21 }.of(&map).values()[1], 1.0);
    }

    #[test]
    fn small_maps_are_enlarged_and_large_ones_reduced_by_whole_numbers() {
        let zoom = |rows, columns| {
            let Zoom { reduced, enlarged } = Zoom::of(rows, columns, 1200);
            (reduced, enlarged)
        };
        assert_eq!(
            [zoom(32, 32), zoom(20, 400), zoom(300, 40), zoom(1000, 40)],
            [(1, 13), (1, 2), (1, 2), (1, 1)]
        );
        assert_eq!([zoom(1200, 1200), zoom(1201, 30), zoom(4096, 3000)], [(1, 1), (2, 1), (4, 1)]);
    }

    #[test]
    fn edges_are_where_their_pixels_are() {
        // Columns 10 to 13 in squares of 4: the first pixel lies 3/8 of a map pixel left of column 10.
        let zoom = Zoom { reduced: 1, enlarged: 4 };
        let window = Window { columns: 10..14, rows: 0..2 };
        let edges = |zoom: Zoom, size, millimetres| {
            zoom.scales(&window, size, millimetres).map(|scale| (scale.first, scale.last))
        };
        assert_eq!(edges(zoom, (16, 8), None), [(9.625, 13.375), (-0.375, 1.375)]);
        // Means of 2 x 2: the first lies between columns 10 and 11.
        let zoom = Zoom { reduced: 2, enlarged: 1 };
        let millimetres = Millimetres { pixel_mm: 0.5, origin_px: (0.0, 0.0) };
        assert_eq!(edges(zoom, (2, 1), Some(millimetres)), [(5.25, 6.25), (0.25, 0.25)]);
        // As in the viewer: (column - 12) x 0.5 mm, (row - 3) x 0.5 mm.
        let millimetres = Millimetres { origin_px: (12.0, 3.0), ..millimetres };
        assert_eq!(edges(zoom, (2, 1), Some(millimetres)), [(-0.75, 0.25), (-1.25, -1.25)]);
    }
}
