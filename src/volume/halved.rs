//! Half the resolution: for what is looked for at large first.

use rayon::prelude::*;

use super::{Samples, Volume};

impl Volume {
    /// The volume at half the resolution: every sample is the mean of 2 x 2, kept to a quarter of a level up to 13 bit and to two levels at 16 bit, a last odd row or
    /// column left out.
    ///
    /// Column X of it lies between the columns 2 X and 2 X + 1 of this volume, and disparities are half as large. It is [fine](Self::fine), with this
    /// volume's frame gains, and takes a quarter of the samples, which are 16 bit wide.
    ///
    /// ```
    /// use epirig::frame::{Frame, Samples};
    /// use epirig::tau::Tau;
    /// use epirig::volume::Volume;
    ///
    /// let mut volume = Volume::new(2, 4, 8, Tau::equidistant(2)?);
    /// volume.insert(0, &Frame::new(2, 4, 8, Samples::U8(vec![1, 2, 10, 10, 2, 2, 20, 20]))?)?;
    /// let mut row = [0.0; 2];
    /// volume.halved().copy_row(0, 0, &mut row);
    /// assert_eq!(row, [1.75, 15.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn halved(&self) -> Self {
        let (rows, columns, frames) = (self.rows / 2, self.columns / 2, self.frames());
        let mut halved = Self::of_zeros(rows, columns, self.bit_depth, self.tau.clone(), true);
        halved.frame_gains.clone_from(&self.frame_gains);
        if rows == 0 || columns == 0 {
            return halved;
        }
        // A level of b bit is 2^(15 - b) counts, and a mean a quarter of four.
        let doublings = if self.fine { -2 } else { 13 - i32::from(self.bit_depth) };
        let columns = self.columns;
        let shown: Vec<usize> = (0..frames).map(|t| self.stored_frame(t)).collect();
        let frames = (self.stored_frames, shown.as_slice());
        match (halved.own_samples(), &*self.samples) {
            (Samples::U16(target), Samples::U8(source)) => halve(target, source, columns, frames, doublings),
            (Samples::U16(target), Samples::U16(source)) => halve(target, source, columns, frames, doublings),
            // A fine volume holds 16 bit.
            _ => {}
        }
        halved
    }
}

/// Sums of 2 x 2 samples of EPIs of frames x columns, doubled this many times, or halved and rounded down. Of so many stored frames some are shown.
fn halve<T: Copy + Into<u32> + Sync>(
    target: &mut [u16],
    source: &[T],
    columns: usize,
    (stored, shown): (usize, &[usize]),
    doublings: i32,
) {
    let (up, down) = (doublings.max(0), (-doublings).max(0));
    let epis = source.par_chunks_exact(2 * columns * stored);
    target.par_chunks_exact_mut(columns / 2 * shown.len()).zip(epis).for_each_init(
        || vec![0; columns],
        |sums, (out, pair)| {
            let (upper, lower) = pair.split_at(columns * stored);
            for (out, t) in out.chunks_exact_mut(columns / 2).zip(shown) {
                let row = t * columns..(t + 1) * columns;
                let (upper, lower) = (&upper[row.clone()], &lower[row]);
                for (sum, (upper, lower)) in sums.iter_mut().zip(upper.iter().zip(lower)) {
                    *sum = (*upper).into() + (*lower).into();
                }
                for (out, pair) in out.iter_mut().zip(sums.chunks_exact(2)) {
                    *out = ((pair[0] + pair[1]) << up >> down) as u16;
                }
            }
        },
    );
}
