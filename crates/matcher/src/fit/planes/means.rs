//! Means over squares of pixels.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use crate::fit::padded::Padded;

/// Rows whose means are found together.
const BAND_ROWS: usize = 16;

/// Means over the square of side 2 `reach` + 1 around each pixel. `term` turns the values of the maps at a
/// pixel into a weight and a weighted value. Pixels whose value in the first map is 0 do not count; the mean
/// of no pixels is 0.
pub(super) fn box_means<const N: usize>(
    maps: [&Padded; N],
    reach: usize,
    term: impl Fn([f32; N]) -> (f32, f32) + Sync,
) -> Padded {
    let stride = maps[0].stride;
    let rows = maps[0].values.len() / stride.max(1);
    let mut means = Padded { stride, values: vec![0.0; maps[0].values.len()] };
    let level = Level::new();
    means.values.par_chunks_mut(BAND_ROWS * stride).enumerate().for_each(|(band, means)| {
        // The compiler may use the instruction set, too.
        dispatch!(level, _simd => band_means(maps, reach, &term, rows, band * BAND_ROWS, means));
    });
    means
}

/// Those of the rows from `first` on, of `rows`.
#[inline(always)]
fn band_means<const N: usize>(
    maps: [&Padded; N],
    reach: usize,
    term: &impl Fn([f32; N]) -> (f32, f32),
    rows: usize,
    first: usize,
    means: &mut [f32],
) {
    let stride = maps[0].stride;
    let from = first.saturating_sub(reach);
    let to = (first + BAND_ROWS + reach).min(rows);
    // The terms of a row serve all rows within reach.
    let mut terms = [(); 2].map(|()| Vec::with_capacity((to - from) * stride));
    let [weights, weighted] = &mut terms;
    for place in from * stride..to * stride {
        let values = maps.map(|map| map.values[place]);
        let (weight, value) = if values[0] > 0.0 { term(values) } else { (0.0, 0.0) };
        weights.push(weight);
        weighted.push(value);
    }
    let side = 2 * reach + 1;
    let mut down = [(); 2].map(|()| vec![0.0_f32; stride]);
    let mut square = [(); 2].map(|()| vec![0.0_f32; stride - 2 * reach]);
    for (y, means) in (first..).zip(means.chunks_exact_mut(stride)) {
        for ((down, square), terms) in down.iter_mut().zip(&mut square).zip(&terms) {
            down.fill(0.0);
            for row in y.saturating_sub(reach)..(y + reach + 1).min(rows) {
                add(down, &terms[(row - from) * stride..]);
            }
            square.fill(0.0);
            (0..side).for_each(|offset| add(square, &down[offset..]));
        }
        let [weights, sums] = &square;
        for (mean, (weight, sum)) in means[reach..].iter_mut().zip(weights.iter().zip(sums)) {
            *mean = if *weight > 0.0 { sum / weight } else { 0.0 };
        }
    }
}

/// Adds to each of `sums` the one of `more` at its place.
#[inline(always)]
fn add(sums: &mut [f32], more: &[f32]) {
    sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
}
