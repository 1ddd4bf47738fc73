//! Images made smaller: means over squares of pixels.

use epirig_core::grid::Grid;

/// Means over squares of `factor` x `factor` pixels of an image of `rows` x `columns`; what is left at the right
/// and at the bottom is dropped.
pub(crate) fn means<T: Copy + Into<f32>>(
    values: &[T],
    rows: usize,
    columns: usize,
    factor: usize,
) -> Grid<f32> {
    let (small_rows, small_columns) = (rows / factor, columns / factor);
    let mut small = Grid::filled(small_rows, small_columns, 0.0_f32);
    for row in 0..small_rows * factor {
        let source = &values[row * columns..][..small_columns * factor];
        for (sum, square) in small.row_mut(row / factor).iter_mut().zip(source.chunks_exact(factor)) {
            *sum += square.iter().map(|&value| value.into()).sum::<f32>();
        }
    }
    let share = 1.0 / (factor * factor) as f32;
    small.values_mut().iter_mut().for_each(|sum| *sum *= share);
    small
}

/// Means over squares of an image.
pub(crate) fn reduced(image: &Grid<f32>, factor: usize) -> Grid<f32> {
    means(image.values(), image.rows(), image.columns(), factor)
}
