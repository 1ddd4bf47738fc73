//! The inner loops over whole rows, to be compiled for each instruction set (`dispatch!`).
//!
//! Rows are processed in chunks whose sums stay in registers over all frames or groups.

use std::ops::Range;

use super::plan::{GroupShift, PAD, Segment};
use crate::lines::Shift;

/// Columns of a chunk. Each row is followed by as many values of any kind, so that its last chunk can be
/// processed as a whole; results beyond the row's end are dropped.
pub(crate) const CHUNK: usize = 64;

/// Rows of equal length behind each other, each with its pads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub(crate) values: &'a [f32],
    pub(crate) stride: usize,
}

impl<'a> Rows<'a> {
    /// `count` values of row `index` from column `start` on.
    #[inline(always)]
    fn part(&self, index: usize, start: isize, count: usize) -> &'a [f32] {
        let first = (index * self.stride + PAD) as isize + start;
        &self.values[first as usize..first as usize + count]
    }
}

/// Mean of the samples of a group's `frames` under `shifts`, and their variance about it, for the given
/// columns of `mean` and `spread`. `anchor` is a row near the mean, to be taken off before squaring.
#[inline(always)]
pub(crate) fn group_sums(
    epi: Rows<'_>,
    frames: Range<usize>,
    shifts: &[Shift],
    anchor: &[f32],
    columns: Range<usize>,
    [mean, spread]: [&mut [f32]; 2],
) {
    for x in columns.clone().step_by(CHUNK) {
        let found = group_chunk(epi, frames.clone(), shifts, &anchor[x..], x);
        put(found, [&mut mean[..], &mut spread[..]], x, columns.end);
    }
}

/// Writes a chunk from column `x` on; what it holds from column `end` on is dropped.
#[inline(always)]
fn put<const N: usize>(chunk: [[f32; CHUNK]; N], out: [&mut [f32]; N], x: usize, end: usize) {
    let count = CHUNK.min(end - x);
    for (out, values) in out.into_iter().zip(chunk) {
        out[x..x + count].copy_from_slice(&values[..count]);
    }
}

#[inline(always)]
fn group_chunk(
    epi: Rows<'_>,
    frames: Range<usize>,
    shifts: &[Shift],
    anchor: &[f32],
    x: usize,
) -> [[f32; CHUNK]; 2] {
    const N: usize = CHUNK;
    let anchor = &anchor[..N];
    let scale = 1.0 / frames.len() as f32;
    let (mut sum, mut squares) = ([0.0_f32; N], [0.0_f32; N]);
    for t in frames {
        let shift = &shifts[t];
        let samples = epi.part(t, x as isize + shift.whole, N + 1);
        let (left, right) = (&samples[..N], &samples[1..N + 1]);
        let fraction = shift.fraction as f32;
        for i in 0..N {
            let deviation = left[i] + fraction * (right[i] - left[i]) - anchor[i];
            sum[i] += deviation;
            squares[i] += deviation * deviation;
        }
    }
    let (mut mean, mut spread) = ([0.0; N], [0.0; N]);
    for i in 0..N {
        let deviation = sum[i] * scale;
        mean[i] = anchor[i] + deviation;
        spread[i] = (squares[i] * scale - deviation * deviation).max(0.0);
    }
    [mean, spread]
}

/// The terms of the costs of one candidate, for one row.
#[derive(Clone, Copy)]
pub(crate) struct Terms<'a> {
    /// Means and variances of each group.
    pub(crate) means: Rows<'a>,
    pub(crate) spreads: Rows<'a>,
    /// Frames of each group.
    pub(crate) frames: &'a [f32],
    /// How many groups lie before the reference frame.
    pub(crate) before: usize,
    /// The reference frame.
    pub(crate) anchor: &'a [f32],
    /// Shift of each group.
    pub(crate) shifts: &'a [GroupShift],
}

/// Variance of the frames along the candidate, unbiased; the least of those that the segment allows.
#[inline(always)]
pub(crate) fn variance(terms: Terms<'_>, segment: &Segment, out: &mut [f32]) {
    for x in segment.columns.clone().step_by(CHUNK) {
        put([variance_chunk(terms, segment, x)], [&mut out[..]], x, segment.columns.end);
    }
}

#[inline(always)]
fn variance_chunk(terms: Terms<'_>, segment: &Segment, x: usize) -> [f32; CHUNK] {
    const N: usize = CHUNK;
    let [all, alone_before, alone_after] = segment.allowed;
    let (sum, squares, frames) = terms.sums::<N>(segment.groups.start..terms.before, x);
    let (sum_after, squares_after, frames_after) = terms.sums::<N>(terms.before..segment.groups.end, x);
    // The reference frame deviates by nothing from itself; it counts on both sides.
    let both = [1.0 + frames, 1.0 + frames_after, 1.0 + frames + frames_after];
    let scales = both.map(|count| 1.0 / (count - 1.0).max(1.0));
    let shares = both.map(|count| 1.0 / count);
    let mut out = [0.0; N];
    for i in 0..N {
        let cost = |sum: f32, squares: f32, side: usize| {
            ((squares - sum * sum * shares[side]) * scales[side]).max(0.0)
        };
        let mut best = f32::INFINITY;
        if all {
            best = cost(sum[i] + sum_after[i], squares[i] + squares_after[i], 2);
        }
        if alone_before {
            best = lesser(best, cost(sum[i], squares[i], 0));
        }
        if alone_after {
            best = lesser(best, cost(sum_after[i], squares_after[i], 1));
        }
        out[i] = best;
    }
    out
}

impl<'a> Terms<'a> {
    /// Sums over `groups` of the deviations from the reference frame and of their squares, and the frames.
    #[inline(always)]
    fn sums<const N: usize>(&self, groups: Range<usize>, x: usize) -> ([f32; N], [f32; N], f32) {
        let anchor = &self.anchor[x..x + N];
        let (mut sum, mut squares, mut count) = ([0.0_f32; N], [0.0_f32; N], 0.0_f32);
        for g in groups {
            let (left, right, fraction) = self.samples::<N>(g, x);
            let (spreads, frames) = (self.spreads::<N>(g, x), self.frames[g]);
            count += frames;
            for i in 0..N {
                let deviation = left[i] + fraction * (right[i] - left[i]) - anchor[i];
                sum[i] += frames * deviation;
                squares[i] += frames * (deviation * deviation + spreads[i]);
            }
        }
        (sum, squares, count)
    }

    #[inline(always)]
    fn samples<const N: usize>(&self, g: usize, x: usize) -> (&'a [f32], &'a [f32], f32) {
        let shift = self.shifts[g];
        let samples = self.means.part(g, x as isize + shift.whole, N + 1);
        (&samples[..N], &samples[1..N + 1], shift.fraction)
    }

    #[inline(always)]
    fn spreads<const N: usize>(&self, g: usize, x: usize) -> &'a [f32] {
        &self.spreads.part(g, x as isize + self.shifts[g].nearest, N)[..N]
    }
}

/// The lesser of two numbers; unlike `f32::min` a single instruction.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Share of the frames that disagree with the reference frame, in units of `limit`: each group deviates from
/// the mean of those that agree by its squared difference and its own variance, and by `limit` at most.
///
/// So a frame in which the point is occluded costs the same, whatever occludes it.
#[inline(always)]
pub(crate) fn truncated(terms: Terms<'_>, segment: &Segment, limit: &[f32], out: &mut [f32]) {
    for x in segment.columns.clone().step_by(CHUNK) {
        put([truncated_chunk(terms, segment, x, &limit[x..])], [&mut out[..]], x, segment.columns.end);
    }
}

#[inline(always)]
fn truncated_chunk(terms: Terms<'_>, segment: &Segment, x: usize, limit: &[f32]) -> [f32; CHUNK] {
    const N: usize = CHUNK;
    let limit = &limit[..N];
    let anchor = &terms.anchor[x..x + N];
    let (mut sum, mut count) = ([0.0_f32; N], [1.0_f32; N]);
    let mut all = 1.0;
    for g in segment.groups.clone() {
        let (spreads, frames) = (terms.spreads::<N>(g, x), terms.frames[g]);
        let (left, right, fraction) = terms.samples::<N>(g, x);
        all += frames;
        for i in 0..N {
            let deviation = left[i] + fraction * (right[i] - left[i]) - anchor[i];
            let agrees = if deviation * deviation + spreads[i] < limit[i] { frames } else { 0.0 };
            sum[i] += agrees * deviation;
            count[i] += agrees;
        }
    }
    let mut mean = [0.0_f32; N];
    let mut cost = [0.0_f32; N];
    for i in 0..N {
        mean[i] = sum[i] / count[i];
        cost[i] = lesser(mean[i] * mean[i], limit[i]);
        mean[i] += anchor[i];
    }
    for g in segment.groups.clone() {
        let (spreads, frames) = (terms.spreads::<N>(g, x), terms.frames[g]);
        let (left, right, fraction) = terms.samples::<N>(g, x);
        for i in 0..N {
            let deviation = left[i] + fraction * (right[i] - left[i]) - mean[i];
            cost[i] += frames * lesser(deviation * deviation + spreads[i], limit[i]);
        }
    }
    let scale = 1.0 / all;
    cost.map(|cost| cost * scale)
}

/// `out[x] = mean of values[x - half ..= x + half]`, as far as they exist.
#[inline(always)]
pub(crate) fn box_means(values: &[f32], half: usize, out: &mut [f32]) {
    let count = values.len();
    let out = &mut out[..count];
    fold_windows(values, half, out, |sum, value| sum + value);
    let scale = 1.0 / (2 * half + 1) as f32;
    let inner = half.min(count)..count.saturating_sub(half).max(half.min(count));
    out[inner.clone()].iter_mut().for_each(|value| *value *= scale);
    for x in (0..inner.start).chain(inner.end..count) {
        out[x] /= ((x + half + 1).min(count) - x.saturating_sub(half)) as f32;
    }
}

/// `out[x] = least of values[x - half ..= x + half]`, as far as they exist.
#[inline(always)]
pub(crate) fn box_minima(values: &[f32], half: usize, out: &mut [f32]) {
    fold_windows(values, half, out, lesser);
}

/// `out[x]` = the values of values[x - half ..= x + half], as far as they exist, joined by `join` from the
/// middle outwards.
#[inline(always)]
fn fold_windows(values: &[f32], half: usize, out: &mut [f32], join: impl Fn(f32, f32) -> f32) {
    let count = values.len();
    let out = &mut out[..count];
    out.copy_from_slice(values);
    for offset in 1..=half.min(count.saturating_sub(1)) {
        let rest = count - offset;
        let (right, left) = (&values[offset..], &values[..rest]);
        for i in 0..rest {
            out[i] = join(out[i], right[i]);
        }
        let out = &mut out[offset..];
        for i in 0..rest {
            out[i] = join(out[i], left[i]);
        }
    }
}

/// `total += entering - leaving`, `leaving = entering`, `out = total * scale` but not below zero.
#[inline(always)]
pub(crate) fn slide(entering: &[f32], leaving: &mut [f32], total: &mut [f32], scale: f32, out: &mut [f32]) {
    let count = entering.len();
    let (leaving, total, out) = (&mut leaving[..count], &mut total[..count], &mut out[..count]);
    for i in 0..count {
        total[i] += entering[i] - leaving[i];
        leaving[i] = entering[i];
        let mean = total[i] * scale;
        out[i] = if mean > 0.0 { mean } else { 0.0 };
    }
}

/// `least = min(least, values)`.
#[inline(always)]
pub(crate) fn keep_lesser(values: &[f32], least: &mut [f32]) {
    least.iter_mut().zip(values).for_each(|(least, &value)| *least = lesser(value, *least));
}

/// `out *= factors`.
#[inline(always)]
pub(crate) fn multiply(factors: &[f32], out: &mut [f32]) {
    out.iter_mut().zip(factors).for_each(|(out, factor)| *out *= factor);
}

/// `out += values * scale`.
#[inline(always)]
pub(crate) fn add_scaled(values: &[f32], scale: f32, out: &mut [f32]) {
    out.iter_mut().zip(values).for_each(|(out, value)| *out += value * scale);
}
