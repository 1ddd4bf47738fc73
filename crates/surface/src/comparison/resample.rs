//! A map at the pixels of another.

use crate::profile::interpolated;
use epirig_core::grid::Grid;

/// Nearer than this to a pixel, its neighbours have no weight, in px: rounding of a whole shift.
const ON_A_PIXEL: f64 = 1e-6;

/// `map` of the second picture at the pixels of a first one of `rows` x `columns`, each of which is at `place` there;
/// interpolated linearly along both
/// axes; NaN where one of the pixels that count is unknown or outside.
///
/// Neighbours share their errors, because windows overlap. So sigmas are interpolated like values, as if the errors
/// were the same: an upper bound.
pub(super) fn carried(
    map: &Grid<f32>,
    place: &dyn Fn(f64, f64) -> (f64, f64),
    (rows, columns): (usize, usize),
) -> Grid<f32> {
    let mut carried = Grid::filled(rows, columns, f32::NAN);
    for y in 0..rows {
        for (x, value) in carried.row_mut(y).iter_mut().enumerate() {
            let (at_x, at_y) = place(x as f64, y as f64);
            let found = interpolated(map, on_a_pixel(at_x), on_a_pixel(at_y));
            *value = found.map_or(f32::NAN, |found| found as f32);
        }
    }
    carried
}

fn on_a_pixel(place: f64) -> f64 {
    if (place - place.round()).abs() < ON_A_PIXEL { place.round() } else { place }
}

/// Where the pixels that `inside` holds are in the second picture: all pixels of `like` that they touch.
pub(super) fn carried_forward(
    inside: &Grid<bool>,
    place: &dyn Fn(f64, f64) -> (f64, f64),
    like: &Grid<f32>,
) -> Grid<bool> {
    let mut there = like.map(|_| false);
    let (rows, columns) = (like.rows() as f64, like.columns() as f64);
    for (index, _) in inside.values().iter().enumerate().filter(|&(_, &inside)| inside) {
        let (x, y) = place((index % inside.columns()) as f64, (index / inside.columns()) as f64);
        for (x, y) in
            [(x.floor(), y.floor()), (x.ceil(), y.floor()), (x.floor(), y.ceil()), (x.ceil(), y.ceil())]
        {
            if (0.0..columns).contains(&x) && (0.0..rows).contains(&y) {
                there.row_mut(y as usize)[x as usize] = true;
            }
        }
    }
    there
}

/// How steep the map is at each pixel, per px: the gradient from the known neighbours to both sides, else to one; 0
/// along an axis without a known neighbour.
pub(super) fn slopes(map: &Grid<f32>) -> Grid<f32> {
    let mut slopes = Grid::filled(map.rows(), map.columns(), 0.0);
    let along = |before: Option<f32>, here: f32, after: Option<f32>| {
        let known = |value: Option<f32>| value.filter(|value| value.is_finite());
        match (known(before), known(after)) {
            (Some(before), Some(after)) => 0.5 * (after - before),
            (Some(before), None) => here - before,
            (None, Some(after)) => after - here,
            (None, None) => 0.0,
        }
    };
    for y in 0..map.rows() {
        for (x, slope) in slopes.row_mut(y).iter_mut().enumerate() {
            let here = map.at(x, y);
            let row = map.row(y);
            let beside = (x.checked_sub(1).map(|x| row[x]), row.get(x + 1).copied());
            let above = y.checked_sub(1).map(|y| map.at(x, y));
            let below = (y + 1 < map.rows()).then(|| map.at(x, y + 1));
            *slope = along(beside.0, here, beside.1).hypot(along(above, here, below));
        }
    }
    slopes
}
