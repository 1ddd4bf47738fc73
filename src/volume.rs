//! The rectified spatio-temporal block f(x, y, t), laid out so that an EPI is contiguous.

use thiserror::Error;

use crate::frame::{Frame, Samples};
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
}

/// All frames of a sequence: rows x frames x columns samples, so that row y of all frames, the EPI, is one slice.
///
/// Samples stay 8 or 16 bit wide; they become floating point one EPI at a time, where they are used.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    rows: usize,
    columns: usize,
    bit_depth: u8,
    tau: Tau,
    samples: Samples,
}

impl Volume {
    /// A volume of zeros for `tau.frames()` frames of `rows` x `columns`.
    pub fn new(rows: usize, columns: usize, bit_depth: u8, tau: Tau) -> Self {
        let samples = Samples::zeros(bit_depth, rows * columns * tau.frames());
        Self { rows, columns, bit_depth, tau, samples }
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
        let columns = self.columns;
        let alike =
            frame.rows() == self.rows && frame.columns() == columns && frame.bit_depth() == self.bit_depth;
        match (&mut self.samples, frame.samples()) {
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

    /// Bits of a sample.
    pub fn bit_depth(&self) -> u8 {
        self.bit_depth
    }

    /// Positions of the frames on the baseline.
    pub fn tau(&self) -> &Tau {
        &self.tau
    }

    /// Row `y` of frame `t` as DN.
    ///
    /// # Panics
    /// If `y` or `t` lies outside the volume, or `target` is not as long as a row.
    pub fn copy_row(&self, y: usize, t: usize, target: &mut [f32]) {
        assert!(y < self.rows && t < self.frames() && target.len() == self.columns);
        self.samples.copy_to_f32((y * self.frames() + t) * self.columns, target);
    }

    /// A copy of the given rows of the given frames, which lie at `tau`.
    ///
    /// # Panics
    /// If a row or frame lies outside the volume, or `tau` has another number of frames.
    pub fn selected(&self, rows: &[usize], frames: &[usize], tau: Tau) -> Self {
        assert_eq!(tau.frames(), frames.len());
        let mut selected = Self::new(rows.len(), self.columns, self.bit_depth, tau);
        let slices =
            rows.iter().flat_map(|y| frames.iter().map(move |t| (y * self.frames() + t) * self.columns));
        match (&mut selected.samples, &self.samples) {
            (Samples::U8(target), Samples::U8(source)) => copy_rows(target, source, self.columns, slices),
            (Samples::U16(target), Samples::U16(source)) => copy_rows(target, source, self.columns, slices),
            // Both volumes have the same bit depth, hence the same type.
            _ => {}
        }
        selected
    }

    /// Bytes that the samples occupy.
    pub fn bytes(&self) -> usize {
        match &self.samples {
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

fn copy_rows<T: Copy>(target: &mut [T], source: &[T], columns: usize, starts: impl Iterator<Item = usize>) {
    for (out, start) in target.chunks_exact_mut(columns).zip(starts) {
        out.copy_from_slice(&source[start..start + columns]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_frames_come_back() {
        let tau = Tau::equidistant(2).unwrap();
        let mut volume = Volume::new(2, 3, 8, tau);
        volume.insert(1, &Frame::new(2, 3, 8, Samples::U8((10..16).collect())).unwrap()).unwrap();
        let mut row = [0.0; 3];
        volume.copy_row(1, 1, &mut row);
        assert_eq!(row, [13.0, 14.0, 15.0]);
        assert_eq!(volume.bytes(), 12);
        let wide = Frame::new(2, 3, 12, Samples::U16(vec![0; 6])).unwrap();
        assert!(matches!(volume.insert(0, &wide), Err(VolumeError::Unlike { bit_depth: 12, .. })));
        let wrong = Frame::new(3, 2, 8, Samples::U8(vec![0; 6])).unwrap();
        assert!(volume.insert(0, &wrong).is_err());
        assert!(matches!(volume.insert(2, &wrong), Err(VolumeError::NoSuchFrame { .. })));
    }
}
