//! Means of 2 x 2 samples.

use fearless_simd::{Level, Simd, dispatch};

use crate::frame::Samples;

/// Means of the samples of two rows, of which each is twice as long as `target` and may be longer, that begin
/// at `starts`.
pub(super) fn copy_means(samples: &Samples, starts: [usize; 2], target: &mut [f32]) {
    let rows = starts.map(|start| start..start + 2 * target.len());
    dispatch!(Level::new(), simd => match samples {
        Samples::U8(values) => means(simd, rows.map(|row| &values[row]), target),
        Samples::U16(values) => means(simd, rows.map(|row| &values[row]), target),
    });
}

#[inline(always)]
fn means<S: Simd, T: Copy + Into<i32>>(_simd: S, [upper, lower]: [&[T]; 2], target: &mut [f32]) {
    let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
    for (out, (upper, lower)) in target.iter_mut().zip(pairs) {
        let sum = upper[0].into() + upper[1].into() + lower[0].into() + lower[1].into();
        *out = 0.25 * sum as f32;
    }
}
