//! How much a frame may disagree before it counts as hiding the point.

use std::ops::Range;

use super::kernels::CHUNK;
use crate::volume::Volume;

/// Half of the columns over which contrast is measured.
const REACH: usize = 4;

/// The limit of squared deviations in DN^2 for each pixel of the rows `held` of the reference frame.
///
/// It is the variance of the intensities around the pixel in its row: two points of one texture differ by twice that in the
/// mean of squares, so most wrong samples exceed it, while noise and small misalignments stay below. `least` is added,
/// so that it is never zero. Each row is followed by the values that a last chunk reads beyond it.
pub(super) fn limits(volume: &Volume, reference: usize, held: Range<usize>, least: f32) -> Vec<Vec<f32>> {
    let mut row = vec![0.0; volume.columns()];
    held.map(|y| {
        volume.copy_row(y, reference, &mut row);
        let beyond = std::iter::repeat_n(least, CHUNK);
        contrast(&row).map(|variance| variance + least).chain(beyond).collect()
    })
    .collect()
}

fn contrast(row: &[f32]) -> impl Iterator<Item = f32> + '_ {
    (0..row.len()).map(|x| {
        let near = &row[x.saturating_sub(REACH)..(x + REACH + 1).min(row.len())];
        let count = near.len() as f32;
        let (sum, squares) = near.iter().fold((0.0, 0.0), |(sum, squares), value| {
            let deviation = value - row[x];
            (sum + deviation, squares + deviation * deviation)
        });
        ((squares - sum * sum / count) / (count - 1.0)).max(0.0)
    })
}
