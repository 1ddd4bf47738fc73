//! Answers from neighbours: isolated answers are dropped, and pixels without an answer try the disparities
//! around them.
//!
//! Among a hundred candidates several fit a pixel by chance; among the few disparities that occur around it
//! hardly any does (propagation; Barnes and others 2009).

use rayon::prelude::*;

use super::result::SearchResult;
use super::task::Task;
use super::tolerance::Tolerance;
use crate::aggregation::rows::{BAND_ROWS, bands};
use crate::cost::factorised::limits::{NOISE_OF_FRAMES, limits};
use crate::cost::factorised::plan::Plan;
use crate::cost::linear_epi::LinearEpi;
use crate::lines::EpiLines;
use crate::one_surface::OneSurface;
use crate::validity::Validity;
use epirig_core::grid::Grid;

/// Of the neighbours at most this far away, in px, ...
const NEIGHBOUR_REACH: usize = 2;
/// ... this many must lie on a pixel's surface: one seen through a gap two pixels wide still has them.
const LEAST_NEIGHBOURS: usize = 6;
/// Neighbours up to this far away offer their disparities, in px.
const TRIED_REACH: usize = 3;

/// Takes back candidates that hardly differ from their rivals, and those that too few neighbours agree with.
pub(super) fn drop_ambiguous(searched: &mut SearchResult, min_confidence: f64) {
    let (rows, columns) = (searched.guess.rows(), searched.guess.columns());
    for (index, confidence) in searched.confidence.values().iter().enumerate() {
        if f64::from(*confidence) < min_confidence && !searched.guess.values()[index].is_nan() {
            searched.guess.values_mut()[index] = f32::NAN;
            searched.validity.values_mut()[index] = Validity::Ambiguous;
        }
    }
    let guess = searched.guess.clone();
    for y in 0..rows {
        for x in 0..columns {
            let own = guess.at(x, y);
            if own.is_nan() {
                continue;
            }
            let near = x.saturating_sub(NEIGHBOUR_REACH)..(x + NEIGHBOUR_REACH + 1).min(columns);
            let around = y.saturating_sub(NEIGHBOUR_REACH)..(y + NEIGHBOUR_REACH + 1).min(rows);
            let like = |u: usize, v: usize| {
                let distance = u.abs_diff(x).max(v.abs_diff(y)) as f32;
                OneSurface::ROUGH.holds(guess.at(u, v) - own, distance)
            };
            let agree: usize = around.clone().map(|v| near.clone().filter(|&u| like(u, v)).count()).sum();
            // At the borders of the image a pixel has fewer neighbours.
            let side = 2 * NEIGHBOUR_REACH + 1;
            if (agree - 1) * side * side < LEAST_NEIGHBOURS * near.len() * around.len() {
                searched.guess.row_mut(y)[x] = f32::NAN;
                searched.validity.row_mut(y)[x] = Validity::Ambiguous;
            }
        }
    }
}

/// Gives pixels that are ambiguous or seem occluded the disparity of a neighbour that enough frames agree
/// with. Their cost is then that of the pixel and its better neighbour in the row; they have no rivals, hence
/// no confidence.
pub(super) fn fill(task: Task<'_>, plan: &Plan, tolerance: Tolerance, searched: &mut SearchResult) {
    let Task { volume, lines, rule, options, progress, .. } = task;
    let columns = searched.guess.columns();
    let resolution = options.method.resolution();
    let dearest = tolerance.largest_cost(options.min_visible);
    // Half as many frames as have to must agree with the pixel itself, however well its neighbour fits.
    let dearest_alone = 0.5 * (1.0 + dearest);
    let before = &*searched;
    let row_of = |y: usize, limits: &[f32]| -> Vec<(usize, f32, f32)> {
        let is_open =
            |x: &usize| matches!(before.validity.at(*x, y), Validity::Ambiguous | Validity::Occluded);
        let open: Vec<usize> = (0..columns).filter(is_open).collect();
        if open.is_empty() || progress.cancelled() {
            return Vec::new();
        }
        let epi = LinearEpi::new(volume, y);
        // A candidate that too few frames have in view does not count.
        let single = |x: usize, disparity: f32| {
            let (cost, seen) = disagreement(&epi, lines, x, disparity, limits[x]);
            rule.suffices(seen).then_some(cost)
        };
        let best = |x: usize| {
            let cost = |disparity: f32| {
                let own = single(x, disparity).filter(|own| *own <= dearest_alone)?;
                let sides = [x.checked_sub(1), Some(x + 1).filter(|&next| next < columns)];
                let side = sides.into_iter().flatten().filter_map(|side| single(side, disparity));
                Some((disparity, 0.5 * (own + side.fold(1.0, f32::min))))
            };
            let tried = surfaces_around(&before.guess, x, y).into_iter().filter_map(cost);
            tried.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|&(_, cost)| cost <= dearest)
        };
        open.into_iter()
            .filter_map(|x| best(x).map(|(disparity, cost)| (x, disparity, cost * limits[x])))
            .collect()
    };
    let bands: Vec<_> = bands(volume.rows(), BAND_ROWS).collect();
    let filled: Vec<_> = bands
        .into_par_iter()
        .flat_map_iter(|band| {
            let limits = limits(volume, plan, band.clone(), resolution, tolerance.share, NOISE_OF_FRAMES);
            band.zip(limits).map(|(y, limits)| (y, row_of(y, &limits))).collect::<Vec<_>>()
        })
        .collect();
    for (y, row) in filled {
        for (x, disparity, cost) in row {
            searched.guess.row_mut(y)[x] = disparity;
            searched.cost.row_mut(y)[x] = cost;
            searched.confidence.row_mut(y)[x] = f32::NAN;
            searched.validity.row_mut(y)[x] = Validity::Found;
        }
    }
}

/// The disparities around a pixel, one for each surface.
fn surfaces_around(guess: &Grid<f32>, x: usize, y: usize) -> Vec<f32> {
    let rows = y.saturating_sub(TRIED_REACH)..(y + TRIED_REACH + 1).min(guess.rows());
    let columns = x.saturating_sub(TRIED_REACH)..(x + TRIED_REACH + 1).min(guess.columns());
    let mut near: Vec<f32> =
        rows.flat_map(|v| &guess.row(v)[columns.clone()]).copied().filter(|value| !value.is_nan()).collect();
    near.sort_unstable_by(f32::total_cmp);
    let surfaces = near.chunk_by(|below, above| OneSurface::ROUGH.holds(above - below, 0.0));
    surfaces.map(|surface| surface[surface.len() / 2]).collect()
}

/// Mean over the frames of the squared deviation from the reference frame's pixel along its line, over
/// `limit` and at most 1; and the number of frames that have the point in view.
fn disagreement(epi: &LinearEpi, lines: &EpiLines, x: usize, disparity: f32, limit: f32) -> (f32, usize) {
    let own = epi.frame(lines.reference())[x];
    let (mut sum, mut seen) = (0.0, 0);
    for (t, &tau) in lines.offsets().iter().enumerate() {
        if let Some(value) = epi.at(t, x as f32 + disparity * tau as f32) {
            let deviation = value - own;
            sum += (deviation * deviation / limit).min(1.0);
            seen += 1;
        }
    }
    (sum / seen.max(1) as f32, seen)
}

#[cfg(test)]
mod tests;
