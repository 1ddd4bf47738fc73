//! Sums over the neighbourhood of each pixel, with Gaussian weights; for wide ones over cells of
//! pixels first.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::observed::Observed;
use crate::fit::padded::{PAD, Padded};

/// Weights reach this many standard deviations.
const REACH_SIGMAS: f32 = 2.5;
/// Rows that are summed together.
const BAND_ROWS: usize = 32;

/// Cells are pixels of a map that has been halved so often.
pub(super) const CELL_HALVINGS: usize = 3;
/// Pixels from one to the next.
pub(super) const CELL: usize = 1 << CELL_HALVINGS;
/// Standard deviation of the Gaussian over cells, in cells: 29 px.
const SIGMA_CELLS: f32 = 3.6;

/// Sums of a map of cells over the neighbourhood of each.
pub(super) fn pooled_cells(level: Level, map: &Padded) -> Padded {
    pooled(level, map, SIGMA_CELLS)
}

/// Sums of a map with Gaussian weights of this standard deviation in px, 1 in the middle. Beyond
/// the borders there is nothing.
pub(super) fn pooled(level: Level, map: &Padded, sigma_px: f32) -> Padded {
    let reach = (REACH_SIGMAS * sigma_px).ceil() as usize;
    assert!(reach <= PAD, "sums reach beyond the room beside rows");
    let weight = |offset: usize| (-0.5 * ((offset as f32 - reach as f32) / sigma_px).powi(2)).exp();
    let weights: Vec<f32> = (0..=2 * reach).map(weight).collect();
    let stride = map.stride;
    let mut sums = Padded { stride, values: vec![0.0; map.values.len()] };
    sums.values.par_chunks_mut(BAND_ROWS * stride).enumerate().for_each(|(band, sums)| {
        dispatch!(level, _simd => band_sums(map, &weights, band * BAND_ROWS, sums));
    });
    sums
}

#[inline(always)]
fn band_sums(map: &Padded, weights: &[f32], first: usize, sums: &mut [f32]) {
    let (stride, reach) = (map.stride, weights.len() / 2);
    let rows = map.values.len() / stride;
    let mut down = vec![0.0_f32; stride];
    for (y, sums) in (first..).zip(sums.chunks_exact_mut(stride)) {
        down.fill(0.0);
        for (row, weight) in (y..).zip(weights) {
            if (reach..rows + reach).contains(&row) {
                add_times(&mut down, map.row(row - reach), *weight);
            }
        }
        let inner = &mut sums[reach..stride - reach];
        weights.iter().enumerate().for_each(|(offset, weight)| add_times(inner, &down[offset..], *weight));
        // Nothing beside the row.
        sums[..PAD].fill(0.0);
        sums[stride - PAD..].fill(0.0);
    }
}

#[inline(always)]
fn add_times(sums: &mut [f32], more: &[f32], weight: f32) {
    sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += weight * more);
}

/// Sums of each 2 x 2 pixels of a map of so many rows and columns, so often.
pub(super) fn halved_sums(mut map: Padded, mut extent: (usize, usize), halvings: usize) -> Padded {
    for _ in 0..halvings {
        map = halved(&map, extent);
        extent = (extent.0.div_ceil(2), extent.1.div_ceil(2));
    }
    map
}

fn halved(map: &Padded, (rows, columns): (usize, usize)) -> Padded {
    let mut halved = Padded::filled(rows.div_ceil(2), columns.div_ceil(2), 0.0);
    halved.par_rows().enumerate().for_each(|(y, out)| {
        let upper = map.row(2 * y);
        let lower = if 2 * y + 1 < rows { map.row(2 * y + 1) } else { &[] };
        for x in 0..columns.div_ceil(2) {
            let pair = PAD + 2 * x..PAD + 2 * x + 2;
            let of = |row: &[f32]| row.get(pair.clone()).map_or(0.0, |pair| pair.iter().sum::<f32>());
            out[PAD + x] = of(upper) + of(lower);
        }
    });
    halved
}

/// A map of one value for each pixel that is observed: its place in the row and its row give it.
pub(super) fn of_observed(observed: &Observed, value: impl Fn(usize, usize) -> f32 + Sync) -> Padded {
    let mut map = Padded::filled(observed.rows(), observed.columns, 0.0);
    map.par_rows().enumerate().for_each(|(y, row)| {
        let precision = observed.precision.row(y);
        for place in PAD..PAD + observed.columns {
            if precision[place] > 0.0 {
                row[place] = value(place, y);
            }
        }
    });
    map
}
