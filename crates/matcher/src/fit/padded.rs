//! Maps with room around each row, so that neighbours of sixteen pixels are loaded at once.

use rayon::prelude::*;

/// Pixels that are computed together.
pub(super) const LANES: usize = 16;
/// Columns kept free on both sides of a row, so that neighbours need no bounds; more than the largest reach
/// and a block.
pub(super) const PAD: usize = 32;

/// One number for each pixel, with room around each row.
#[derive(Debug, Clone)]
pub(super) struct Padded {
    pub(super) stride: usize,
    pub(super) values: Vec<f32>,
}

impl Padded {
    pub(super) fn filled(rows: usize, columns: usize, value: f32) -> Self {
        let stride = columns.next_multiple_of(LANES) + 2 * PAD;
        // Filled by all threads, because the first access to memory is slow.
        Self { stride, values: rayon::iter::repeat_n(value, rows * stride).collect() }
    }

    /// Row `y` with the room on both sides.
    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.stride..(y + 1) * self.stride]
    }

    #[cfg(test)]
    pub(super) fn row_mut(&mut self, y: usize) -> &mut [f32] {
        &mut self.values[y * self.stride..(y + 1) * self.stride]
    }

    pub(super) fn par_rows(&mut self) -> rayon::slice::ChunksMut<'_, f32> {
        self.values.par_chunks_mut(self.stride)
    }
}
