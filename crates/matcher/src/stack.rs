//! Frames as callers have them: a slice, an array or images, put into the volume that is matched.

use epirig_core::frame::{Frame, FrameError, Samples};
use epirig_core::tau::{Tau, TauError};
use epirig_core::volume::{Volume, VolumeError};
use rayon::prelude::*;
use thiserror::Error;

/// Frames x rows x columns of grey images, rectified: a point moves along its row from frame to frame.
///
/// The samples are copied once, into the order in which they are matched. Frames are equidistant on the
/// baseline unless [`at`](Self::at) says where they were taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Stack {
    volume: Volume,
}

/// Why samples make no stack.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum StackError {
    /// The number of samples is not that of the shape.
    #[error(
        "{samples} samples are not {frames} frames of {rows} rows x {columns} columns; give the shape as frames, rows, columns"
    )]
    Length {
        /// Samples given.
        samples: usize,
        /// Frames asked for.
        frames: usize,
        /// Rows asked for.
        rows: usize,
        /// Columns asked for.
        columns: usize,
    },
    /// A sample is not a finite number.
    #[error(
        "frame {frame} has {value} at row {row}, column {column}; give a finite number there, also where a mask leaves the pixel out"
    )]
    NotFinite {
        /// Index of the frame, from 0.
        frame: usize,
        /// Row of the sample.
        row: usize,
        /// Its column.
        column: usize,
        /// The sample.
        value: f64,
    },
    /// There is not a position for each frame.
    #[error("{positions} positions are given for {frames} frames; give one for each")]
    Positions {
        /// Positions given.
        positions: usize,
        /// Frames of the stack.
        frames: usize,
    },
    /// The positions are those of no baseline.
    #[error(transparent)]
    Tau(#[from] TauError),
    /// The samples of a frame do not fit its size or bit depth.
    #[error("frame {index}: {source}")]
    Frame {
        /// Index of the frame, from 0.
        index: usize,
        /// What is wrong with it.
        source: FrameError,
    },
    /// A frame is unlike the others.
    #[error(transparent)]
    Unlike(#[from] VolumeError),
}

impl Stack {
    /// From samples of 8 bit in the order of frames, rows and columns.
    ///
    /// # Errors
    /// [`StackError`] if their number is not that of the shape, or there are fewer than two frames.
    pub fn from_u8(samples: &[u8], shape: [usize; 3]) -> Result<Self, StackError> {
        let layout = Layout::of(shape, samples.len())?;
        let gathered = layout.gathered(|t, y| samples[layout.row(t, y)].iter().copied());
        layout.stack(8, Samples::U8(gathered))
    }

    /// From samples of 16 bit in the order of frames, rows and columns.
    ///
    /// # Errors
    /// As [`from_u8`](Self::from_u8).
    pub fn from_u16(samples: &[u16], shape: [usize; 3]) -> Result<Self, StackError> {
        let layout = Layout::of(shape, samples.len())?;
        let gathered = layout.gathered(|t, y| samples[layout.row(t, y)].iter().copied());
        layout.stack(16, Samples::U16(gathered))
    }

    /// From samples of any unit in the order of frames, rows and columns; see [`FloatLevels`].
    ///
    /// # Errors
    /// As [`from_u8`](Self::from_u8), or if a sample is not a finite number.
    pub fn from_f32(samples: &[f32], shape: [usize; 3]) -> Result<Self, StackError> {
        let layout = Layout::of(shape, samples.len())?;
        layout.floats(|t, y| samples[layout.row(t, y)].iter().copied())
    }

    /// From frames of one size and bit depth. Each is copied and dropped before the next one is asked for.
    ///
    /// # Errors
    /// [`StackError`] if a frame is unlike the first, or there are fewer than two.
    pub fn from_frames<E: From<StackError>>(
        frames: impl ExactSizeIterator<Item = Result<Frame, E>>,
    ) -> Result<Self, E> {
        let tau = Tau::equidistant(frames.len()).map_err(StackError::from)?;
        let mut volume: Option<Volume> = None;
        let mut count = 0;
        for (t, frame) in frames.enumerate() {
            let frame = frame?;
            count += 1;
            let new = || Volume::new(frame.rows(), frame.columns(), frame.bit_depth(), tau.clone());
            volume.get_or_insert_with(new).insert(t, &frame).map_err(StackError::from)?;
        }
        match volume {
            Some(volume) if count == tau.frames() => Ok(Self { volume }),
            // An iterator that has fewer frames than it says.
            _ => Err(StackError::Tau(TauError::TooFew(count)).into()),
        }
    }

    /// From grey images of 8 bit, all of one size. Each is copied and dropped before the next one is asked
    /// for.
    ///
    /// # Errors
    /// [`StackError`] if an image is unlike the first, or there are fewer than two.
    #[cfg(feature = "image")]
    pub fn from_images(images: impl ExactSizeIterator<Item = image::GrayImage>) -> Result<Self, StackError> {
        Self::from_frames(images.enumerate().map(|(index, image)| {
            let (rows, columns) = (image.height() as usize, image.width() as usize);
            let frame = Frame::new(rows, columns, 8, Samples::U8(image.into_raw()));
            frame.map_err(|source| StackError::Frame { index, source })
        }))
    }

    /// The same frames, taken at these stage positions: one for each frame in any unit, increasing.
    ///
    /// # Errors
    /// [`StackError`] if there is not one for each, or they make no baseline.
    pub fn at(self, positions: &[f64]) -> Result<Self, StackError> {
        let (positions_given, frames) = (positions.len(), self.volume.frames());
        if positions_given != frames {
            return Err(StackError::Positions { positions: positions_given, frames });
        }
        Ok(Self { volume: self.volume.at(Tau::from_positions(positions)?) })
    }

    /// Number of frames, rows and columns.
    pub fn shape(&self) -> [usize; 3] {
        [self.volume.frames(), self.volume.rows(), self.volume.columns()]
    }

    /// What is matched.
    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    /// What is matched, for a [`Matcher`](super::Matcher): with a mask, or in its own memory.
    pub fn into_volume(self) -> Volume {
        self.volume
    }
}

/// From samples in any unit to 16 bit: the largest one becomes 65535 DN. Zero, or the smallest sample if that
/// is negative, becomes 0 DN: light that changes is a factor of what lies above it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloatLevels {
    zero: f64,
    largest: f64,
}

impl FloatLevels {
    /// For the samples of frame `frame`, which has this many columns.
    ///
    /// # Errors
    /// [`StackError::NotFinite`] with the place of the first sample that is not a finite number.
    pub fn of(frame: usize, columns: usize, samples: impl Iterator<Item = f64>) -> Result<Self, StackError> {
        let (mut zero, mut largest) = (0.0_f64, 0.0_f64);
        for (index, value) in samples.enumerate() {
            if !value.is_finite() {
                let (row, column) = (index / columns, index % columns);
                return Err(StackError::NotFinite { frame, row, column, value });
            }
            (zero, largest) = (zero.min(value), largest.max(value));
        }
        Ok(Self { zero, largest })
    }

    /// For the samples of all these frames.
    pub fn of_all(frames: &[Self]) -> Self {
        let none = Self { zero: 0.0, largest: 0.0 };
        frames.iter().fold(none, |all, one| Self {
            zero: all.zero.min(one.zero),
            largest: all.largest.max(one.largest),
        })
    }

    /// The level of `value`, rounded.
    pub fn level(self, value: f64) -> u16 {
        // Halves, because the span of the largest numbers is beyond them.
        let span = 0.5 * self.largest - 0.5 * self.zero;
        let share = (0.5 * value - 0.5 * self.zero) / span;
        // Without light there is no span; NaN becomes 0.
        (f64::from(u16::MAX) * share).round() as u16
    }
}

/// Where samples of frames x rows x columns lie, and go to.
#[derive(Clone, Copy)]
struct Layout {
    frames: usize,
    rows: usize,
    columns: usize,
}

impl Layout {
    fn of([frames, rows, columns]: [usize; 3], samples: usize) -> Result<Self, StackError> {
        let count = rows.checked_mul(columns).and_then(|pixels| pixels.checked_mul(frames));
        if count != Some(samples) || samples == 0 {
            return Err(StackError::Length { samples, frames, rows, columns });
        }
        Ok(Self { frames, rows, columns })
    }

    /// Row `y` of frame `t`, as the caller has it.
    fn row(self, t: usize, y: usize) -> std::ops::Range<usize> {
        let start = (t * self.rows + y) * self.columns;
        start..start + self.columns
    }

    /// Rows x frames x columns of what `samples` gives of row `y` of frame `t`.
    fn gathered<T: Copy + Default + Send, I: Iterator<Item = T>>(
        self,
        samples: impl Fn(usize, usize) -> I + Sync,
    ) -> Vec<T> {
        let mut gathered = vec![T::default(); self.rows * self.frames * self.columns];
        gathered.par_chunks_exact_mut(self.frames * self.columns).enumerate().for_each(|(y, epi)| {
            for (t, row) in epi.chunks_exact_mut(self.columns).enumerate() {
                row.iter_mut().zip(samples(t, y)).for_each(|(out, value)| *out = value);
            }
        });
        gathered
    }

    /// The stack of samples of any unit; see [`FloatLevels`].
    fn floats<I: Iterator<Item = f32>>(
        self,
        samples: impl Fn(usize, usize) -> I + Sync,
    ) -> Result<Stack, StackError> {
        let range = |t: usize| {
            let frame = (0..self.rows).flat_map(|y| samples(t, y));
            FloatLevels::of(t, self.columns, frame.map(f64::from))
        };
        let ranges: Vec<FloatLevels> =
            (0..self.frames).into_par_iter().map(range).collect::<Result<_, _>>()?;
        let levels = FloatLevels::of_all(&ranges);
        let gathered = self.gathered(|t, y| samples(t, y).map(|value| levels.level(value.into())));
        self.stack(16, Samples::U16(gathered))
    }

    fn stack(self, bit_depth: u8, gathered: Samples) -> Result<Stack, StackError> {
        let tau = Tau::equidistant(self.frames)?;
        let volume = Volume::from_samples((self.rows, self.columns), bit_depth, tau, gathered)?;
        Ok(Stack { volume })
    }
}

#[cfg(feature = "ndarray")]
mod arrays {
    use ndarray::{ArrayView3, s};

    use super::{Layout, Samples, Stack, StackError};

    /// What the samples of an array may be: `u8`, `u16` or `f32`.
    pub trait Sample: Copy + Send + Sync + sealed::Sealed {
        #[doc(hidden)]
        fn stacked(array: ArrayView3<'_, Self>) -> Result<Stack, StackError>;
    }

    mod sealed {
        pub trait Sealed {}
        impl Sealed for u8 {}
        impl Sealed for u16 {}
        impl Sealed for f32 {}
    }

    fn layout<T>(array: &ArrayView3<'_, T>) -> Result<Layout, StackError> {
        let (frames, rows, columns) = array.dim();
        Layout::of([frames, rows, columns], array.len())
    }

    impl Sample for u8 {
        fn stacked(array: ArrayView3<'_, Self>) -> Result<Stack, StackError> {
            let layout = layout(&array)?;
            let gathered = layout.gathered(|t, y| array.slice(s![t, y, ..]).into_iter().copied());
            layout.stack(8, Samples::U8(gathered))
        }
    }

    impl Sample for u16 {
        fn stacked(array: ArrayView3<'_, Self>) -> Result<Stack, StackError> {
            let layout = layout(&array)?;
            let gathered = layout.gathered(|t, y| array.slice(s![t, y, ..]).into_iter().copied());
            layout.stack(16, Samples::U16(gathered))
        }
    }

    impl Sample for f32 {
        fn stacked(array: ArrayView3<'_, Self>) -> Result<Stack, StackError> {
            let layout = layout(&array)?;
            layout.floats(|t, y| array.slice(s![t, y, ..]).into_iter().copied())
        }
    }

    impl Stack {
        /// From an array of frames x rows x columns, however it lies in memory.
        ///
        /// # Errors
        /// As [`from_u8`](Self::from_u8) and [`from_f32`](Self::from_f32).
        pub fn from_array<T: Sample>(array: ArrayView3<'_, T>) -> Result<Self, StackError> {
            T::stacked(array)
        }
    }
}

#[cfg(feature = "ndarray")]
pub use arrays::Sample;
