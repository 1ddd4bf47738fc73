//! The inner loops of the mapping's search, compiled for each instruction set and chosen at run time.
//!
//! A column of the search holds one value for each candidate. The step from one column to the next is a
//! minimum over a window that slides along the candidates. It is never found one value at a time: eight or
//! more neighbours are found together, from shifted copies of the column.

use fearless_simd::{Simd, SimdBase, f32x8};

use crate::cost::CostTable;

/// Candidates that are treated together; a column's length is a multiple of this.
pub(super) const LANES: usize = 8;
/// Columns that are taken out of the cost table together.
pub(super) const BLOCK: usize = 4 * LANES;

/// The lesser of two numbers. Unlike `f32::min` it says nothing of NaN, and so is one instruction.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The least of `values`; infinite for no values.
#[inline(always)]
pub(super) fn least(values: &[f32]) -> f32 {
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut lanes = [f32::INFINITY; LANES];
    for chunk in chunks {
        for (lane, &value) in lanes.iter_mut().zip(chunk) {
            *lane = lesser(*lane, value);
        }
    }
    rest.iter().chain(&lanes).fold(f32::INFINITY, |low, &value| lesser(low, value))
}

/// Costs of up to [`BLOCK`] columns of `costs` from `first` on, one column after the other.
///
/// A cost of NaN becomes `unknown`, and places beyond the candidates are infinite.
#[inline(always)]
pub(super) fn take_columns<S: Simd>(simd: S, costs: &CostTable, first: usize, unknown: f32, out: &mut [f32]) {
    let (columns, length) = (costs.columns(), out.len() / BLOCK);
    let unknown = f32x8::splat(simd, unknown);
    for start in (0..length).step_by(LANES) {
        for half in 0..BLOCK / LANES {
            let x = first + half * LANES;
            if columns <= x {
                break;
            }
            let width = (columns - x).min(LANES);
            let mut rows = [f32x8::splat(simd, f32::INFINITY); LANES];
            for (lane, row) in rows.iter_mut().enumerate().take(costs.candidates().saturating_sub(start)) {
                let costs = costs.row(start + lane);
                let values = if width == LANES {
                    f32x8::from_slice(simd, &costs[x..x + LANES])
                } else {
                    let mut part = [f32::INFINITY; LANES];
                    part[..width].copy_from_slice(&costs[x..x + width]);
                    f32x8::from_slice(simd, &part)
                };
                *row = simd.select_f32x8(values.simd_eq(values), values, unknown);
            }
            for (column, values) in transposed(simd, rows).iter().enumerate() {
                let begin = (half * LANES + column) * length + start;
                values.store_slice(&mut out[begin..begin + LANES]);
            }
        }
    }
}

/// Rows to columns: three perfect shuffles of the 64 values, each of which moves one bit of a value's row
/// behind its column.
#[inline(always)]
fn transposed<S: Simd>(simd: S, mut rows: [f32x8<S>; LANES]) -> [f32x8<S>; LANES] {
    for _ in 0..LANES.ilog2() {
        let mut shuffled = rows;
        for index in 0..LANES / 2 {
            (shuffled[2 * index], shuffled[2 * index + 1]) =
                simd.interleave_f32x8(rows[index], rows[index + LANES / 2]);
        }
        rows = shuffled;
    }
    rows
}

/// `out[k] = costs[k] + least of reached[k .. k + side]`.
///
/// `windows` and `scratch` are as long as `reached` and are overwritten.
#[inline(always)]
pub(super) fn step(
    reached: &[f32],
    side: usize,
    costs: &[f32],
    [windows, scratch]: [&mut Vec<f32>; 2],
    out: &mut [f32],
) {
    // Windows of 1, 4, 16 ... values, each of four of those before; the window asked for is covered by four
    // of the last.
    let mut width = 1;
    let mut source = reached;
    if 4 <= side {
        four(source, 1, windows);
        width = 4;
        while 4 * width <= side {
            four(windows, width, scratch);
            std::mem::swap(windows, scratch);
            width *= 4;
        }
        source = windows;
    }
    let part = |index: usize| {
        let begin = (index * width).min(side - width);
        &source[begin..begin + costs.len()]
    };
    let [a, b, c, d] = std::array::from_fn(part);
    let out = &mut out[..costs.len()];
    for k in 0..costs.len() {
        out[k] = costs[k] + lesser(lesser(a[k], b[k]), lesser(c[k], d[k]));
    }
}

/// `out[i]` = the least of `values` at i and at one, two and three times `separation` beyond it, as far as
/// they exist.
#[inline(always)]
fn four(values: &[f32], separation: usize, out: &mut [f32]) {
    let count = values.len().saturating_sub(3 * separation);
    let [a, b, c, d] = std::array::from_fn(|index| &values[index * separation..index * separation + count]);
    let out = &mut out[..count];
    for k in 0..count {
        out[k] = lesser(lesser(a[k], b[k]), lesser(c[k], d[k]));
    }
}
