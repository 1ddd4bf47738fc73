//! The inner loops over whole rows, compiled for each instruction set and chosen at run time.
//!
//! Plain loops over slices of equal length: the compiler turns them into vector code inside `dispatch!`.

use fearless_simd::{Level, Simd, dispatch};

use crate::aggregation::window_sums::window_sums;
use crate::cost::interpolation::TAPS;

/// `out[x] = sum of weights * taps[x ..]`.
pub(super) fn sample(level: Level, taps: &[f32], weights: [f32; TAPS], out: &mut [f32]) {
    dispatch!(level, simd => sample_row(simd, taps, weights, out));
}

#[inline(always)]
fn sample_row<S: Simd>(_simd: S, taps: &[f32], weights: [f32; TAPS], out: &mut [f32]) {
    let count = out.len();
    let (a, b, c, d) = (&taps[..count], &taps[1..count + 1], &taps[2..count + 2], &taps[3..count + 3]);
    for x in 0..count {
        out[x] = weights[0] * a[x] + weights[1] * b[x] + weights[2] * c[x] + weights[3] * d[x];
    }
}

/// Adds to `sum` and `squares` the samples less `anchor` and the squares of that.
pub(super) fn add_deviations(
    level: Level,
    taps: &[f32],
    weights: [f32; TAPS],
    anchor: &[f32],
    sum: &mut [f32],
    squares: &mut [f32],
) {
    if weights[0] == 0.0 && weights[3] == 0.0 {
        dispatch!(level, simd => add_two_tap_deviations(simd, taps, weights, anchor, sum, squares));
    } else {
        dispatch!(level, simd => add_row_deviations(simd, taps, weights, anchor, sum, squares));
    }
}

#[inline(always)]
fn add_row_deviations<S: Simd>(
    _simd: S,
    taps: &[f32],
    weights: [f32; TAPS],
    anchor: &[f32],
    sum: &mut [f32],
    squares: &mut [f32],
) {
    let count = sum.len();
    let (a, b, c, d) = (&taps[..count], &taps[1..count + 1], &taps[2..count + 2], &taps[3..count + 3]);
    let (anchor, squares) = (&anchor[..count], &mut squares[..count]);
    for x in 0..count {
        let sample = weights[0] * a[x] + weights[1] * b[x] + weights[2] * c[x] + weights[3] * d[x];
        let deviation = sample - anchor[x];
        sum[x] += deviation;
        squares[x] += deviation * deviation;
    }
}

#[inline(always)]
fn add_two_tap_deviations<S: Simd>(
    _simd: S,
    taps: &[f32],
    weights: [f32; TAPS],
    anchor: &[f32],
    sum: &mut [f32],
    squares: &mut [f32],
) {
    let count = sum.len();
    let (b, c) = (&taps[1..count + 1], &taps[2..count + 2]);
    let (anchor, squares) = (&anchor[..count], &mut squares[..count]);
    for x in 0..count {
        let deviation = weights[1] * b[x] + weights[2] * c[x] - anchor[x];
        sum[x] += deviation;
        squares[x] += deviation * deviation;
    }
}

/// Adds to `sums` the samples, their squares and their products with the model.
pub(super) fn add_products(level: Level, samples: &[f32], model: &[f32], sums: [&mut [f32]; 3]) {
    dispatch!(level, simd => add_row_products(simd, samples, model, sums));
}

#[inline(always)]
fn add_row_products<S: Simd>(_simd: S, samples: &[f32], model: &[f32], sums: [&mut [f32]; 3]) {
    let count = samples.len();
    let [sum, squares, products] = sums.map(|slice| &mut slice[..count]);
    let model = &model[..count];
    for x in 0..count {
        sum[x] += samples[x];
        squares[x] += samples[x] * samples[x];
        products[x] += samples[x] * model[x];
    }
}

/// `out[x] = sum of values[x .. x + side]`; `values` is `side - 1` longer than `out`.
pub(super) fn box_sums(level: Level, values: &[f32], side: usize, out: &mut [f32]) {
    dispatch!(level, _simd => window_sums(values, side, out));
}

/// Adds to `total` the normalised correlation of each window with the model's, from the windows' sums over
/// `count` pixels; nothing where either has no contrast.
pub(super) fn add_correlation(
    level: Level,
    windows: [&[f32]; 3],
    model: [&[f32]; 2],
    count: f32,
    total: &mut [f32],
) {
    dispatch!(level, simd => add_row_correlation(simd, windows, model, count, total));
}

#[inline(always)]
fn add_row_correlation<S: Simd>(
    _simd: S,
    windows: [&[f32]; 3],
    model: [&[f32]; 2],
    count: f32,
    total: &mut [f32],
) {
    let columns = total.len();
    let [sum, squares, products] = windows.map(|slice| &slice[..columns]);
    let [model_sum, model_squares] = model.map(|slice| &slice[..columns]);
    // Below this share of the squares the difference of sums is rounding: 24 bits of an f32 over some hundred
    // terms.
    const ROUNDING: f32 = 1e-5;
    for x in 0..columns {
        let energy = squares[x] - sum[x] * sum[x] / count;
        let model_energy = model_squares[x] - model_sum[x] * model_sum[x] / count;
        let covariance = products[x] - sum[x] * model_sum[x] / count;
        let contrast = energy > ROUNDING * squares[x] && model_energy > ROUNDING * model_squares[x];
        let correlation = covariance / (energy * model_energy).max(f32::MIN_POSITIVE).sqrt();
        total[x] += if contrast { correlation } else { 0.0 };
    }
}
