//! Frames made small: a hundred of them are held at once.

use epirig_core::frame::{Frame, Samples};

/// A small frame of 8 bit, and one of half its size.
#[derive(Debug, Clone)]
pub(super) struct Reduced {
    /// Pixels of the frame for one of this, in either direction.
    pub(super) factor: usize,
    pub(super) fine: Small,
    pub(super) coarse: Small,
}

/// Means over squares of pixels.
#[derive(Debug, Clone)]
pub(super) struct Small {
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) values: Vec<f32>,
}

impl Reduced {
    /// A frame reduced until its longer side has `longest` pixels at most.
    pub(super) fn of(frame: &Frame, longest: usize) -> Self {
        let factor = frame.rows().max(frame.columns()).div_ceil(longest).max(1);
        let fine = match frame.samples() {
            Samples::U8(values) => Small::reduce(values, frame.rows(), frame.columns(), factor),
            Samples::U16(values) => Small::reduce(values, frame.rows(), frame.columns(), factor),
        };
        let coarse = fine.reduced(2);
        Self { factor, fine, coarse }
    }
}

impl Small {
    fn reduce<T: Copy + Into<f32>>(values: &[T], rows: usize, columns: usize, factor: usize) -> Self {
        let (small_rows, small_columns) = (rows / factor, columns / factor);
        let mut small = vec![0.0_f32; small_rows * small_columns];
        for row in 0..small_rows * factor {
            let source = &values[row * columns..][..small_columns * factor];
            let target = &mut small[row / factor * small_columns..][..small_columns];
            for (sum, square) in target.iter_mut().zip(source.chunks_exact(factor)) {
                *sum += square.iter().map(|&value| value.into()).sum::<f32>();
            }
        }
        let share = 1.0 / (factor * factor) as f32;
        small.iter_mut().for_each(|sum| *sum *= share);
        Self { rows: small_rows, columns: small_columns, values: small }
    }

    pub(super) fn reduced(&self, factor: usize) -> Self {
        Self::reduce(&self.values, self.rows, self.columns, factor)
    }

    pub(super) fn row(&self, row: usize, first: usize, count: usize) -> &[f32] {
        &self.values[row * self.columns + first..][..count]
    }
}
