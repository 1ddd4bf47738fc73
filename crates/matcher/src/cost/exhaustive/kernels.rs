//! The inner loops over whole rows, to be compiled for each instruction set (`dispatch!`).
//!
//! Plain loops over slices of equal length: the compiler turns them into vector code inside `dispatch!`.

use crate::cost::interpolation::TAPS;

/// `out[x] = sum of weights * taps[x ..]`.
#[inline(always)]
pub(super) fn sample(taps: &[f32], weights: [f32; TAPS], out: &mut [f32]) {
    let count = out.len();
    let (a, b, c, d) = (&taps[..count], &taps[1..count + 1], &taps[2..count + 2], &taps[3..count + 3]);
    for x in 0..count {
        out[x] = weights[0] * a[x] + weights[1] * b[x] + weights[2] * c[x] + weights[3] * d[x];
    }
}

/// Adds to `sum` and `squares` the samples less `anchor` and the squares of that.
#[inline(always)]
pub(super) fn add_deviations(
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

/// Adds to `sums` the samples, their squares and their products with the model.
#[inline(always)]
pub(super) fn add_products(samples: &[f32], model: &[f32], sums: [&mut [f32]; 3]) {
    let count = samples.len();
    let [sum, squares, products] = sums.map(|slice| &mut slice[..count]);
    let model = &model[..count];
    for x in 0..count {
        sum[x] += samples[x];
        squares[x] += samples[x] * samples[x];
        products[x] += samples[x] * model[x];
    }
}

/// Adds to `total` the normalised correlation of each window with the model's, from the windows' sums over
/// `count` pixels; nothing where either has no contrast.
#[inline(always)]
pub(super) fn add_correlation(windows: [&[f32]; 3], model: [&[f32]; 2], count: f32, total: &mut [f32]) {
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
