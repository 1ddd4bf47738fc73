//! Sums over windows of a row.

use std::ops::AddAssign;

/// `out[x] = sum of values[x .. x + side]`; `values` is `side - 1` longer than `out`.
#[inline(always)]
pub(crate) fn window_sums<T: Copy + AddAssign>(values: &[T], side: usize, out: &mut [T]) {
    let count = out.len();
    out.copy_from_slice(&values[..count]);
    for offset in 1..side {
        let shifted = &values[offset..offset + count];
        for x in 0..count {
            out[x] += shifted[x];
        }
    }
}
