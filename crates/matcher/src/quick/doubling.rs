//! From half the resolution to the whole one.
//!
//! On one surface disparities are interpolated. Where several surfaces lie around a pixel, edge refinement
//! decides ([`edge_refinement`](crate::search::edge_refinement)).

use rayon::prelude::*;

use crate::search::edge_refinement::{Around, OpenPixel, Place};
use crate::search::{SearchResult, Task};
use epirig_core::grid::Grid;

/// The result of the search at half the resolution, for each pixel of `task`: disparities twice as large,
/// with refined edges; cost, confidence and kind of answer are those of the halved pixel that contains it.
/// `reach` is how far from a surface its disparity may be found, in px of the halved frames.
pub(super) fn refined(task: Task<'_>, coarse: &SearchResult, reach: usize) -> SearchResult {
    let (rows, columns) = (task.volume.rows(), task.volume.columns());
    let mut guess = Grid::filled(rows, columns, f32::NAN);
    let around = Around::new(&coarse.guess, 2.0, reach);
    let guesses = guess.values_mut().par_chunks_mut(columns).enumerate();
    guesses.for_each(|(y, guess)| {
        if !task.progress.cancelled() {
            refine_row(task, &coarse.guess, &around, y, guess);
        }
    });
    SearchResult {
        guess,
        cost: doubled(&coarse.cost, rows, columns),
        confidence: doubled(&coarse.confidence, rows, columns),
        validity: doubled(&coarse.validity, rows, columns),
        deviation_share: coarse.deviation_share,
    }
}

/// The halved pixel that holds the one at `place`, or is next to it beyond an even count.
fn holder(place: usize, halved_count: usize) -> usize {
    (place / 2).min(halved_count - 1)
}

/// Each value four times, in a map of this many rows and columns.
fn doubled<T: Copy + Send + Sync>(halved: &Grid<T>, rows: usize, columns: usize) -> Grid<T> {
    let mut map = Grid::filled(rows, columns, halved.at(0, 0));
    map.values_mut().par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
        let row = halved.row(holder(y, halved.rows()));
        for (x, out) in out.iter_mut().enumerate() {
            *out = row[holder(x, row.len())];
        }
    });
    map
}

/// Disparities of row `y` in px, from those of halved pixels.
fn refine_row(task: Task<'_>, coarse: &Grid<f32>, around: &Around<'_>, y: usize, guess: &mut [f32]) {
    let row = holder(y, coarse.rows());
    let (upper, lower, down) = between(y, coarse.rows());
    let mut open = Vec::new();
    for (x, guess) in guess.iter_mut().enumerate() {
        let column = holder(x, coarse.columns());
        let place = Place { column, row };
        let (left, right, across) = between(x, coarse.columns());
        let along = |v: usize| {
            let row = coarse.row(v);
            row[left] + across * (row[right] - row[left])
        };
        let above = along(upper);
        let own = coarse.at(column, row);
        *guess = 2.0 * (above + down * (along(lower) - above));
        let is_edge = !own.is_nan() && around.is_edge(place);
        if is_edge {
            open.push(OpenPixel { x, place });
        }
        if is_edge || guess.is_nan() || own.is_nan() {
            *guess = 2.0 * own;
        }
    }
    around.refine_row(task, y, &open, guess);
}

/// The halved pixels before and after the one at `place`, and the share of the latter: their middles lie
/// between two pixels.
fn between(place: usize, halved_count: usize) -> (usize, usize, f32) {
    let last = halved_count - 1;
    let after = place.div_ceil(2);
    (after.saturating_sub(1).min(last), after.min(last), if place.is_multiple_of(2) { 0.75 } else { 0.25 })
}
