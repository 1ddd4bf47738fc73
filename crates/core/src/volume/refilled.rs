//! Samples replaced in their place by values computed from them.

use std::ops::Range;

use rayon::prelude::*;

use super::Volume;
use crate::frame::{Samples, full_scale};

impl Volume {
    /// The volume with its samples replaced by those that `fill` makes of them, in DN of `bit_depth`;
    /// [fine](Self::fine) if asked for. They are replaced in their place, unless they are shared with another
    /// volume: then they are copied. `fill` gets samples with the frames' gains, which are 1 afterwards.
    ///
    /// `fill` is called for up to `band_rows` rows of each frame, in any order and from any thread. It gets
    /// the rows, the frame, the values in DN of those rows and of up to `reach` rows above and below (as far
    /// as the frame has them), and room for the rows' new values. Samples are rounded to whole counts and
    /// clipped to their range.
    ///
    /// # Panics
    /// If samples of `bit_depth`, or fine ones, are wider or narrower than the volume's.
    pub fn refilled(
        mut self,
        (bit_depth, fine): (u8, bool),
        (band_rows, reach): (usize, usize),
        fill: impl Fn(Range<usize>, usize, &[f32], &mut [f32]) + Sync,
    ) -> Self {
        // Means of pixels become samples of their own.
        self.own_samples();
        let dn_per_count = self.dn_per_count();
        let gains: Vec<f32> = self.frame_gains.iter().map(|gain| dn_per_count * gain).collect();
        let size = (self.frames(), self.columns);
        (self.bit_depth, self.fine) = (bit_depth, fine);
        self.frame_gains.fill(1.0);
        let counts_per_dn = 1.0 / self.dn_per_count();
        // Casts round towards zero and clip to the range of the type; a bit depth may have a smaller one.
        let largest = if fine { u16::MAX } else { full_scale(bit_depth) };
        let count = move |value: f32| (value * counts_per_dn + 0.5).min(largest.into());
        let wide = fine || bit_depth > 8;
        let bands = (band_rows, reach);
        match self.own_samples() {
            Samples::U8(samples) if !wide => refill(samples, size, &gains, bands, fill, |v| count(v) as u8),
            Samples::U16(samples) if wide => refill(samples, size, &gains, bands, fill, |v| count(v) as u16),
            _ => panic!("samples of {bit_depth} bit have another width than those that they replace"),
        }
        self
    }
}

/// Refills bands of rows x frames x columns in their place; `gains` make DN of the samples of each frame, and
/// `convert` samples of DN.
fn refill<T: Copy + Into<f32> + Send + Sync>(
    samples: &mut [T],
    (frames, columns): (usize, usize),
    gains: &[f32],
    (band_rows, reach): (usize, usize),
    fill: impl Fn(Range<usize>, usize, &[f32], &mut [f32]) + Sync,
    convert: impl Fn(f32) -> T + Sync,
) {
    let epi = frames * columns;
    // The rows that a band needs of its neighbours, before they change.
    let beside: Vec<[Vec<T>; 2]> = (0..samples.len().div_ceil(band_rows * epi))
        .map(|index| {
            let (start, end) = (index * band_rows * epi, ((index + 1) * band_rows * epi).min(samples.len()));
            let beyond = (end + reach * epi).min(samples.len());
            [samples[start.saturating_sub(reach * epi)..start].to_vec(), samples[end..beyond].to_vec()]
        })
        .collect();
    samples.par_chunks_mut(band_rows * epi).zip(beside).enumerate().for_each(
        |(index, (band, [above, below]))| {
            let rows = band.len() / epi;
            let mut values = Vec::new();
            let mut filled = vec![0.0; rows * columns];
            for (t, &gain) in gains.iter().enumerate() {
                let own = t * columns..(t + 1) * columns;
                values.clear();
                for rows in [&above[..], band, &below[..]] {
                    let rows = rows.chunks_exact(epi).flat_map(|row| &row[own.clone()]);
                    values.extend(rows.map(|&sample| gain * sample.into()));
                }
                fill(index * band_rows..index * band_rows + rows, t, &values, &mut filled);
                for (epi, row) in band.chunks_exact_mut(epi).zip(filled.chunks_exact(columns)) {
                    epi[own.clone()].iter_mut().zip(row).for_each(|(out, &value)| *out = convert(value));
                }
            }
        },
    );
}
