//! The rectified spatio-temporal block f(x, y, t), laid out so that an EPI is contiguous.

mod halved;

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use thiserror::Error;

use crate::frame::{Frame, Samples, full_scale};
use crate::tau::Tau;

/// Why a frame does not go into a volume.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// A frame of another size or bit depth than the volume.
    #[error(
        "frame {index} is {columns} x {rows} of {bit_depth} bit, the volume {expected_columns} x {expected_rows} of \
         {expected_bit_depth} bit; all frames must be alike"
    )]
    Unlike {
        /// Index of the frame, from 0.
        index: usize,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
        /// Its bit depth.
        bit_depth: u8,
        /// Rows of the volume.
        expected_rows: usize,
        /// Columns of the volume.
        expected_columns: usize,
        /// Bit depth of the volume.
        expected_bit_depth: u8,
    },
    /// There is no such frame in the volume.
    #[error("frame {index} lies outside the volume of {frames} frames")]
    NoSuchFrame {
        /// Index given.
        index: usize,
        /// Frames of the volume.
        frames: usize,
    },
    /// A frame as the sensor gave it was to go into a volume of rectified ones.
    #[error(
        "frame {index} is not rectified, the volume holds rectified frames; put it in through the rectifier"
    )]
    NotRectified {
        /// Index of the frame, from 0.
        index: usize,
    },
}

/// Counts of a fine volume from 0 to full scale: half of what 16 bit hold.
const FINE_COUNTS: f32 = 32768.0;

/// All frames of a sequence: rows x frames x columns samples, so that row y of all frames, the EPI, is one slice.
///
/// Clones share their samples until one of them is written.
///
/// Samples stay 8 or 16 bit wide; they become floating point one EPI at a time, where they are used. Frames that were resampled go
/// into a [fine](Self::fine) volume, which keeps what lies between the camera's levels.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    rows: usize,
    columns: usize,
    bit_depth: u8,
    tau: Tau,
    /// Rows x stored frames x columns.
    samples: Arc<Samples>,
    /// Number of frames that are stored, and which of them are the volume's; `None`: all of them.
    stored_frames: usize,
    shown_frames: Option<Vec<usize>>,
    /// Whether samples are fractions of a level.
    fine: bool,
    /// What the samples of each frame are multiplied by.
    frame_gains: Vec<f32>,
}

impl Volume {
    /// A volume of zeros for `tau.frames()` frames of `rows` x `columns`.
    pub fn new(rows: usize, columns: usize, bit_depth: u8, tau: Tau) -> Self {
        Self::of_zeros(rows, columns, bit_depth, tau, false)
    }

    /// A volume of zeros for resampled frames of a camera of `bit_depth` bits.
    ///
    /// A sample is 16 bit wide and counts (full scale + 1) / 32768 DN, 1/128 DN for 8 bit; so the camera's levels up to 15 bit are
    /// whole counts, and there is room up to twice full scale for what corrections brighten and splines overshoot.
    pub fn fine(rows: usize, columns: usize, bit_depth: u8, tau: Tau) -> Self {
        Self::of_zeros(rows, columns, bit_depth, tau, true)
    }

    fn of_zeros(rows: usize, columns: usize, bit_depth: u8, tau: Tau, fine: bool) -> Self {
        let count = rows * columns * tau.frames();
        let samples = if fine { Samples::U16(vec![0; count]) } else { Samples::zeros(bit_depth, count) };
        let (stored_frames, frame_gains) = (tau.frames(), vec![1.0; tau.frames()]);
        let samples = Arc::new(samples);
        Self { rows, columns, bit_depth, tau, samples, stored_frames, shown_frames: None, fine, frame_gains }
    }

    /// Puts `frame` at place `index`.
    ///
    /// # Errors
    /// [`VolumeError`] if the frame is unlike the volume or the index is not in it.
    pub fn insert(&mut self, index: usize, frame: &Frame) -> Result<(), VolumeError> {
        let frames = self.frames();
        if index >= frames {
            return Err(VolumeError::NoSuchFrame { index, frames });
        }
        if self.fine {
            return Err(VolumeError::NotRectified { index });
        }
        let columns = self.columns;
        let alike =
            frame.rows() == self.rows && frame.columns() == columns && frame.bit_depth() == self.bit_depth;
        match (self.own_samples(), frame.samples()) {
            (Samples::U8(target), Samples::U8(source)) if alike => {
                scatter(target, source, index, frames, columns);
            }
            (Samples::U16(target), Samples::U16(source)) if alike => {
                scatter(target, source, index, frames, columns);
            }
            _ => {
                return Err(VolumeError::Unlike {
                    index,
                    rows: frame.rows(),
                    columns: frame.columns(),
                    bit_depth: frame.bit_depth(),
                    expected_rows: self.rows,
                    expected_columns: self.columns,
                    expected_bit_depth: self.bit_depth,
                });
            }
        }
        Ok(())
    }

    /// Puts the counts of a [fine](Self::fine) volume, as samples of 16 bit, at place `index`.
    ///
    /// # Errors
    /// [`VolumeError`] if the samples are not 16 bit wide or of another size, the volume is not fine, or the index is not in it.
    pub fn insert_counts(&mut self, index: usize, counts: &Frame) -> Result<(), VolumeError> {
        let (frames, columns) = (self.frames(), self.columns);
        if index >= frames {
            return Err(VolumeError::NoSuchFrame { index, frames });
        }
        let alike = self.fine && counts.rows() == self.rows && counts.columns() == columns;
        match (self.own_samples(), counts.samples()) {
            (Samples::U16(target), Samples::U16(source)) if alike => {
                scatter(target, source, index, frames, columns);
                Ok(())
            }
            _ => Err(VolumeError::Unlike {
                index,
                rows: counts.rows(),
                columns: counts.columns(),
                bit_depth: counts.bit_depth(),
                expected_rows: self.rows,
                expected_columns: self.columns,
                expected_bit_depth: 16,
            }),
        }
    }

    /// Number of rows, which is the number of EPIs.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.tau.frames()
    }

    /// Bits of the camera's samples.
    pub fn bit_depth(&self) -> u8 {
        self.bit_depth
    }

    /// Positions of the frames on the baseline.
    pub fn tau(&self) -> &Tau {
        &self.tau
    }

    /// Whether the volume holds resampled frames, finer than the camera's levels.
    pub fn is_fine(&self) -> bool {
        self.fine
    }

    /// What a step of a sample is worth before the frame's gain, in DN: 1 but for a [fine](Self::fine) volume.
    pub fn dn_per_count(&self) -> f32 {
        if self.fine { (f32::from(full_scale(self.bit_depth)) + 1.0) / FINE_COUNTS } else { 1.0 }
    }

    /// The samples of a [fine](Self::fine) volume in counts: rows x frames x columns; `None` for any other volume.
    pub fn fine_counts_mut(&mut self) -> Option<&mut [u16]> {
        let fine = self.fine;
        match self.own_samples() {
            Samples::U16(counts) if fine => Some(counts),
            _ => None,
        }
    }

    /// The samples, of the volume's frames alone and shared with no other volume.
    fn own_samples(&mut self) -> &mut Samples {
        if self.shown_frames.is_some() {
            let [rows, frames] = [self.rows, self.frames()].map(|count| (0..count).collect::<Vec<usize>>());
            *self = self.selected(&rows, &frames, self.tau.clone());
        }
        Arc::make_mut(&mut self.samples)
    }

    /// What the samples of frame `t` are multiplied by: 1 until it is set.
    ///
    /// # Panics
    /// If `t` lies outside the volume.
    pub fn frame_gain(&self, t: usize) -> f32 {
        self.frame_gains[t]
    }

    /// Multiplies whatever is read of frame `t` by `gain`, for a lamp that flickers; it replaces the gain set before.
    ///
    /// # Panics
    /// If `t` lies outside the volume.
    pub fn set_frame_gain(&mut self, t: usize, gain: f32) {
        self.frame_gains[t] = gain;
    }

    /// Row `y` of frame `t` as DN, with the frame's gain.
    ///
    /// # Panics
    /// If `y` or `t` lies outside the volume, or `target` is not as long as a row.
    pub fn copy_row(&self, y: usize, t: usize, target: &mut [f32]) {
        assert!(y < self.rows && t < self.frames() && target.len() == self.columns);
        self.samples.copy_to_f32((y * self.stored_frames + self.stored_frame(t)) * self.columns, target);
        let factor = self.dn_per_count() * self.frame_gains[t];
        if factor != 1.0 {
            target.iter_mut().for_each(|value| *value *= factor);
        }
    }

    /// A copy of the given rows of the given frames, which lie at `tau`, with their gains.
    ///
    /// # Panics
    /// If a row or frame lies outside the volume, or `tau` has another number of frames.
    pub fn selected(&self, rows: &[usize], frames: &[usize], tau: Tau) -> Self {
        assert_eq!(tau.frames(), frames.len());
        let mut selected = Self::of_zeros(rows.len(), self.columns, self.bit_depth, tau, self.fine);
        selected.frame_gains = frames.iter().map(|&t| self.frame_gains[t]).collect();
        let size = (self.stored_frames, self.columns);
        let frames: Vec<usize> = frames.iter().map(|&t| self.stored_frame(t)).collect();
        match (selected.own_samples(), &*self.samples) {
            (Samples::U8(target), Samples::U8(source)) => copy_rows(target, source, size, (rows, &frames)),
            (Samples::U16(target), Samples::U16(source)) => copy_rows(target, source, size, (rows, &frames)),
            // Both volumes are of one kind and bit depth, hence of one type.
            _ => {}
        }
        selected
    }

    /// The given frames, which lie at `tau`, with their gains: no copy, the samples are shared.
    ///
    /// # Panics
    /// If a frame lies outside the volume, or `tau` has another number of frames.
    pub(crate) fn showing(&self, frames: &[usize], tau: Tau) -> Self {
        assert_eq!(tau.frames(), frames.len());
        Self {
            tau,
            samples: Arc::clone(&self.samples),
            shown_frames: Some(frames.iter().map(|&t| self.stored_frame(t)).collect()),
            frame_gains: frames.iter().map(|&t| self.frame_gains[t]).collect(),
            ..*self
        }
    }

    /// The place of frame `t` among those that are stored.
    fn stored_frame(&self, t: usize) -> usize {
        self.shown_frames.as_ref().map_or(t, |shown| shown[t])
    }

    /// The volume with samples that `fill` makes of those that it had, in DN of `bit_depth`; [fine](Self::fine) if asked for. They take the place of
    /// the old ones, unless those are shared: then it is a copy that changes. Frames' gains are part of what `fill` is given, and are 1 afterwards.
    ///
    /// `fill` is called for up to `band_rows` rows of each frame, in any order and from any thread: with the rows, the frame, the values in DN of those
    /// rows and of up to `reach` above and below that the frame has, and room for the rows' own values. Samples are rounded to whole counts and clipped
    /// to those that there are.
    ///
    /// # Panics
    /// If samples of `bit_depth`, or fine ones, are wider or narrower than the volume's.
    pub fn refilled(
        mut self,
        (bit_depth, fine): (u8, bool),
        (band_rows, reach): (usize, usize),
        fill: impl Fn(Range<usize>, usize, &[f32], &mut [f32]) + Sync,
    ) -> Self {
        let dn_per_count = self.dn_per_count();
        let gains: Vec<f32> = self.frame_gains.iter().map(|gain| dn_per_count * gain).collect();
        let size = (self.frames(), self.columns);
        (self.bit_depth, self.fine) = (bit_depth, fine);
        self.frame_gains.fill(1.0);
        let counts_per_dn = 1.0 / self.dn_per_count();
        // Casts round towards zero and clip to what the type holds; a bit depth may hold less.
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

    /// Bytes that the samples occupy.
    pub fn bytes(&self) -> usize {
        match &*self.samples {
            Samples::U8(values) => values.len(),
            Samples::U16(values) => 2 * values.len(),
        }
    }
}

fn scatter<T: Copy>(target: &mut [T], source: &[T], index: usize, frames: usize, columns: usize) {
    for (epi, row) in target.chunks_exact_mut(frames * columns).zip(source.chunks_exact(columns)) {
        epi[index * columns..(index + 1) * columns].copy_from_slice(row);
    }
}

/// Refills bands of rows x frames x columns in their place; `gains` make DN of the samples of each frame, and `convert` samples of DN.
fn refill<T: Copy + Into<f32> + Send + Sync>(
    samples: &mut [T],
    (frames, columns): (usize, usize),
    gains: &[f32],
    (band_rows, reach): (usize, usize),
    fill: impl Fn(Range<usize>, usize, &[f32], &mut [f32]) + Sync,
    convert: impl Fn(f32) -> T + Sync,
) {
    let epi = frames * columns;
    // What a band needs of its neighbours, as it was before they changed.
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

/// Copies the given rows of the given frames from EPIs of this many frames and columns.
fn copy_rows<T: Copy + Send + Sync>(
    target: &mut [T],
    source: &[T],
    (count, columns): (usize, usize),
    (rows, frames): (&[usize], &[usize]),
) {
    let epis = target.par_chunks_exact_mut(frames.len() * columns).zip(rows);
    epis.for_each(|(epi, y)| {
        for (out, t) in epi.chunks_exact_mut(columns).zip(frames) {
            let start = (y * count + t) * columns;
            out.copy_from_slice(&source[start..start + columns]);
        }
    });
}

#[cfg(test)]
mod tests;
