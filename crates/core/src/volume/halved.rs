//! The volume at half the resolution, for coarse-to-fine search.

use rayon::prelude::*;

use super::Volume;
use crate::tau::Tau;

impl Volume {
    /// The volume at half the resolution: every pixel is the mean of 2 x 2, a last odd row or column left
    /// out.
    ///
    /// Column X of it lies between the columns 2 X and 2 X + 1 of this volume, and disparities are half as
    /// large. It has this volume's frame gains and shares its samples: means are taken where rows are read,
    /// which takes less time than to store them and fetch them again.
    ///
    /// ```
    /// use epirig_core::frame::{Frame, Samples};
    /// use epirig_core::tau::Tau;
    /// use epirig_core::volume::Volume;
    ///
    /// let mut volume = Volume::new(2, 4, 8, Tau::equidistant(2)?);
    /// volume.insert(0, &Frame::new(2, 4, 8, Samples::U8(vec![1, 2, 10, 10, 2, 2, 20, 20]))?)?;
    /// let mut row = [0.0; 2];
    /// volume.halved().copy_row(0, 0, &mut row);
    /// assert_eq!(row, [1.75, 15.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn halved(&self) -> Self {
        let mut source = self.clone();
        if source.halved {
            source.own_samples();
        }
        Self { rows: source.rows / 2, columns: source.columns / 2, halved: true, ..source }
    }

    /// Given rows of given frames, which lie at `tau`, as a fine volume.
    pub(super) fn rounded(&self, rows: &[usize], frames: &[usize], tau: Tau) -> Self {
        let columns = self.columns;
        let mut rounded = Self::of_zeros(rows.len(), columns, self.bit_depth, tau, true);
        rounded.frame_gains = frames.iter().map(|&t| self.frame_gains[t]).collect();
        let counts = self.dn_per_count() / rounded.dn_per_count();
        if let Some(samples) = rounded.fine_counts_mut() {
            let epis = samples.par_chunks_exact_mut((frames.len() * columns).max(1)).zip(rows);
            epis.for_each(|(epi, &y)| {
                let mut row = vec![0.0; columns];
                for (out, &t) in epi.chunks_exact_mut(columns).zip(frames) {
                    self.copy_counts(y, t, &mut row);
                    out.iter_mut().zip(&row).for_each(|(out, value)| *out = (value * counts + 0.5) as u16);
                }
            });
        }
        rounded
    }
}
