//! The rectified spatio-temporal block f(x, y, t), laid out so that an EPI is contiguous.

mod filling;
mod halved;
mod means;
mod refilled;
mod shape;

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use thiserror::Error;

use crate::frame::{Frame, FrameFormat, Samples, full_scale};
use crate::tau::Tau;
pub use filling::Filling;
use means::copy_means;
pub use shape::VolumeShape;

/// Why a frame does not go into a volume.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// A frame of another size or bit depth than the volume.
    #[error("frame {index} is {found}, the volume {expected}; all frames must be alike")]
    Unlike {
        /// Index of the frame, from 0.
        index: usize,
        /// Its size and bit depth.
        found: FrameFormat,
        /// Those of the volume.
        expected: FrameFormat,
    },
    /// Samples that are not those of so many frames.
    #[error("{samples} samples are not {frames} frames of {format}")]
    Samples {
        /// Samples given.
        samples: usize,
        /// Frames of the volume.
        frames: usize,
        /// Their size and bit depth.
        format: FrameFormat,
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

/// Counts of a fine volume from 0 to full scale: half of the range of 16 bit.
const FINE_COUNTS: f32 = 32768.0;

/// All frames of a sequence: rows x frames x columns samples, so that row y of all frames, the EPI, is one
/// slice.
///
/// Clones share their samples until one of them is written.
///
/// Samples stay 8 or 16 bit wide; they become floating point one EPI at a time, where they are used.
/// Resampled frames go into a [fine](Self::fine) volume, which resolves fractions of the camera's levels.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    rows: usize,
    columns: usize,
    bit_depth: u8,
    tau: Tau,
    /// Rows x stored frames x columns.
    samples: Arc<Samples>,
    /// Number of columns and of frames that are stored.
    stored_columns: usize,
    stored_frames: usize,
    /// Whether each pixel is the mean of 2 x 2 that are stored.
    halved: bool,
    /// Which of the stored frames are the volume's; `None`: all of them.
    shown_frames: Option<Vec<usize>>,
    /// Whether samples are fractions of a level.
    fine: bool,
    /// Factor of the samples of each frame.
    frame_gains: Vec<f32>,
}

impl Volume {
    /// A volume of zeros for `tau.frames()` frames of `rows` x `columns`.
    pub fn new(rows: usize, columns: usize, bit_depth: u8, tau: Tau) -> Self {
        Self::of_zeros(rows, columns, bit_depth, tau, false)
    }

    /// A volume of zeros for resampled frames of a camera of `bit_depth` bits.
    ///
    /// A sample is 16 bit wide and counts (full scale + 1) / 32768 DN, 1/128 DN for 8 bit. So the camera's
    /// levels up to 15 bit are whole counts, and there is room up to twice full scale for samples that
    /// corrections brighten and splines overshoot.
    pub fn fine(rows: usize, columns: usize, bit_depth: u8, tau: Tau) -> Self {
        Self::of_zeros(rows, columns, bit_depth, tau, true)
    }

    /// A volume over samples in its own order, rows x frames x columns, of frames of (rows, columns) and
    /// `bit_depth` bits.
    ///
    /// # Errors
    /// [`VolumeError::Samples`] if their number or width is another.
    pub fn from_samples(
        (rows, columns): (usize, usize),
        bit_depth: u8,
        tau: Tau,
        samples: Samples,
    ) -> Result<Self, VolumeError> {
        let count = rows.checked_mul(columns).and_then(|pixels| pixels.checked_mul(tau.frames()));
        let narrow = matches!(samples, Samples::U8(_));
        let width = FrameFormat { rows, columns, bit_depth };
        if count != Some(samples.len()) || narrow != (bit_depth <= 8) {
            return Err(VolumeError::Samples { samples: samples.len(), frames: tau.frames(), format: width });
        }
        let empty = Self::of_zeros(0, 0, bit_depth, tau, false);
        let samples = Arc::new(samples);
        Ok(Self { rows, columns, stored_columns: columns, samples, ..empty })
    }

    /// The same frames at other places.
    ///
    /// # Panics
    /// If `tau` has another number of frames.
    #[must_use]
    pub fn at(self, tau: Tau) -> Self {
        assert_eq!(tau.frames(), self.frames());
        Self { tau, ..self }
    }

    fn of_zeros(rows: usize, columns: usize, bit_depth: u8, tau: Tau, fine: bool) -> Self {
        let count = rows * columns * tau.frames();
        let samples = if fine { Samples::U16(vec![0; count]) } else { Samples::zeros(bit_depth, count) };
        Self {
            rows,
            columns,
            bit_depth,
            samples: Arc::new(samples),
            stored_columns: columns,
            stored_frames: tau.frames(),
            halved: false,
            shown_frames: None,
            fine,
            frame_gains: vec![1.0; tau.frames()],
            tau,
        }
    }

    /// Puts `frame` at place `index`. [`filling`](Self::filling) takes frames from several threads.
    ///
    /// # Errors
    /// [`VolumeError`] if the frame is unlike the volume or the index is not in it.
    pub fn insert(&mut self, index: usize, frame: &Frame) -> Result<(), VolumeError> {
        self.filling().insert(index, frame)
    }

    /// Puts the counts of a [fine](Self::fine) volume, as samples of 16 bit, at place `index`.
    ///
    /// # Errors
    /// [`VolumeError`] if the samples are not 16 bit wide or of another size, the volume is not fine, or the
    /// index is not in it.
    pub fn insert_counts(&mut self, index: usize, counts: &Frame) -> Result<(), VolumeError> {
        self.filling().insert_counts(index, counts)
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
        self.fine || self.halved
    }

    /// Size of a count before the frame's gain, in DN: 1 except for a [fine](Self::fine) volume.
    pub fn dn_per_count(&self) -> f32 {
        if self.fine { (f32::from(full_scale(self.bit_depth)) + 1.0) / FINE_COUNTS } else { 1.0 }
    }

    /// The samples of a [fine](Self::fine) volume in counts: rows x frames x columns; `None` for any other
    /// volume.
    pub fn fine_counts_mut(&mut self) -> Option<&mut [u16]> {
        let fine = self.is_fine();
        match self.own_samples() {
            Samples::U16(counts) if fine => Some(counts),
            _ => None,
        }
    }

    /// The samples, of the volume's frames alone and shared with no other volume.
    fn own_samples(&mut self) -> &mut Samples {
        if self.shown_frames.is_some() || self.halved {
            let [rows, frames] = [self.rows, self.frames()].map(|count| (0..count).collect::<Vec<usize>>());
            *self = self.selected(&rows, &frames, self.tau.clone());
        }
        Arc::make_mut(&mut self.samples)
    }

    /// Factor of the samples of frame `t`: 1 until it is set.
    ///
    /// # Panics
    /// If `t` lies outside the volume.
    pub fn frame_gain(&self, t: usize) -> f32 {
        self.frame_gains[t]
    }

    /// Multiplies the samples of frame `t` by `gain` wherever they are read, for a lamp that flickers;
    /// replaces the gain set before.
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
        let factor = self.dn_per_count() * self.frame_gains[t];
        self.copy_counts(y, t, target);
        if factor != 1.0 {
            target.iter_mut().for_each(|value| *value *= factor);
        }
    }

    /// Row `y` of frame `t` in stored counts, or fractions of them.
    fn copy_counts(&self, y: usize, t: usize, target: &mut [f32]) {
        let start = |y: usize| (y * self.stored_frames + self.stored_frame(t)) * self.stored_columns;
        if self.halved {
            copy_means(&self.samples, [2 * y, 2 * y + 1].map(start), target);
        } else {
            self.samples.copy_to_f32(start(y), target);
        }
    }

    /// A copy of the given rows of the given frames, which lie at `tau`, with their gains; of means of
    /// pixels, a [fine](Self::fine) one.
    ///
    /// # Panics
    /// If a row or frame lies outside the volume, or `tau` has another number of frames.
    pub fn selected(&self, rows: &[usize], frames: &[usize], tau: Tau) -> Self {
        assert_eq!(tau.frames(), frames.len());
        if self.halved {
            return self.rounded(rows, frames, tau);
        }
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
    pub fn showing(&self, frames: &[usize], tau: Tau) -> Self {
        assert_eq!(tau.frames(), frames.len());
        Self {
            tau,
            samples: Arc::clone(&self.samples),
            shown_frames: Some(frames.iter().map(|&t| self.stored_frame(t)).collect()),
            frame_gains: frames.iter().map(|&t| self.frame_gains[t]).collect(),
            ..*self
        }
    }

    /// Leaves out all other rows, without a copy of those that stay unless samples are shared.
    ///
    /// # Panics
    /// If a row of `rows` lies outside the volume.
    pub fn keep_rows(&mut self, rows: Range<usize>) {
        assert!(rows.start <= rows.end && rows.end <= self.rows);
        if rows == (0..self.rows) {
            return;
        }
        let epi = self.frames() * self.columns;
        let kept = rows.start * epi..rows.end * epi;
        match self.own_samples() {
            Samples::U8(values) => keep(values, kept),
            Samples::U16(values) => keep(values, kept),
        }
        self.rows = rows.len();
    }

    /// The place of frame `t` among those that are stored.
    fn stored_frame(&self, t: usize) -> usize {
        self.shown_frames.as_ref().map_or(t, |shown| shown[t])
    }

    /// Bytes that the samples occupy.
    pub fn bytes(&self) -> usize {
        match &*self.samples {
            Samples::U8(values) => values.len(),
            Samples::U16(values) => 2 * values.len(),
        }
    }
}

/// Drops all other values, and the room that they took.
fn keep<T>(values: &mut Vec<T>, kept: Range<usize>) {
    values.truncate(kept.end);
    values.drain(..kept.start);
    values.shrink_to_fit();
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
