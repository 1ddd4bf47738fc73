//! The rows of an image, in pieces for threads and as a sample.

use std::ops::Range;

/// Rows that a thread searches in one go; windows reach a little beyond them.
pub(crate) const BAND_ROWS: usize = 32;

/// The rows of an image in pieces of `height` for one thread each.
pub(crate) fn bands(rows: usize, height: usize) -> impl Iterator<Item = Range<usize>> {
    (0..rows).step_by(height).map(move |y| y..(y + height).min(rows))
}

/// Number of rows in which the cost of right candidates is measured.
const SAMPLED_ROWS: usize = 8;

/// A few rows, spread over an image of `rows`.
pub(crate) fn sampled_rows(rows: usize) -> Vec<usize> {
    spread_rows(rows, SAMPLED_ROWS.min(rows)).collect()
}

/// `count` rows, spread evenly over an image of `rows`.
pub(crate) fn spread_rows(rows: usize, count: usize) -> impl Iterator<Item = usize> {
    (0..count).map(move |index| (2 * index + 1) * rows / (2 * count))
}
