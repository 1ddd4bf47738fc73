//! Frames put into a volume from several threads at once.

use std::sync::{Mutex, PoisonError};

use super::{Volume, VolumeError};
use crate::frame::{Frame, FrameFormat, Samples};

/// Rows that a thread writes while others wait for them: a few dozen pieces of work for each frame.
const BAND_ROWS: usize = 32;

/// The places of a volume's frames, for frames that come from several threads; see [`Volume::filling`].
///
/// A frame's rows lie far apart in a volume, so rows of several frames can be written at once.
#[derive(Debug)]
pub struct Filling<'a> {
    rows: usize,
    columns: usize,
    frames: usize,
    bit_depth: u8,
    fine: bool,
    bands: Bands<'a>,
}

/// Rows x frames x columns in bands of rows.
#[derive(Debug)]
enum Bands<'a> {
    U8(Vec<Mutex<&'a mut [u8]>>),
    U16(Vec<Mutex<&'a mut [u16]>>),
}

impl Volume {
    /// The places of the frames, to be filled from several threads.
    ///
    /// ```
    /// use epirig_core::frame::{Frame, Samples};
    /// use epirig_core::tau::Tau;
    /// use epirig_core::volume::Volume;
    ///
    /// let mut volume = Volume::new(2, 3, 8, Tau::equidistant(2)?);
    /// let filling = volume.filling();
    /// std::thread::scope(|threads| {
    ///     for t in 0..2 {
    ///         let filling = &filling;
    ///         threads.spawn(move || {
    ///             let frame = Frame::new(2, 3, 8, Samples::U8(vec![t; 6])).unwrap();
    ///             filling.insert(t.into(), &frame)
    ///         });
    ///     }
    /// });
    /// let mut row = [0.0; 3];
    /// volume.copy_row(1, 1, &mut row);
    /// assert_eq!(row, [1.0; 3]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn filling(&mut self) -> Filling<'_> {
        let (rows, columns, frames) = (self.rows, self.columns, self.frames());
        let (bit_depth, fine) = (self.bit_depth, self.is_fine());
        let band = (BAND_ROWS * frames * columns).max(1);
        let bands = match self.own_samples() {
            Samples::U8(values) => Bands::U8(values.chunks_mut(band).map(Mutex::new).collect()),
            Samples::U16(values) => Bands::U16(values.chunks_mut(band).map(Mutex::new).collect()),
        };
        Filling { rows, columns, frames, bit_depth, fine, bands }
    }
}

impl Filling<'_> {
    /// Puts `frame` at place `index`.
    ///
    /// # Errors
    /// [`VolumeError`] if the frame is unlike the volume or the index is not in it.
    pub fn insert(&self, index: usize, frame: &Frame) -> Result<(), VolumeError> {
        self.check_index(index)?;
        if self.fine {
            return Err(VolumeError::NotRectified { index });
        }
        self.put(index, frame, frame.bit_depth() == self.bit_depth, self.bit_depth)
    }

    /// Puts the counts of a [fine](Volume::fine) volume, as samples of 16 bit, at place `index`.
    ///
    /// # Errors
    /// [`VolumeError`] if the samples are not 16 bit wide or of another size, the volume is not fine, or the
    /// index is not in it.
    pub fn insert_counts(&self, index: usize, counts: &Frame) -> Result<(), VolumeError> {
        self.check_index(index)?;
        self.put(index, counts, self.fine, 16)
    }

    fn check_index(&self, index: usize) -> Result<(), VolumeError> {
        match index < self.frames {
            true => Ok(()),
            false => Err(VolumeError::NoSuchFrame { index, frames: self.frames }),
        }
    }

    fn put(
        &self,
        index: usize,
        frame: &Frame,
        alike: bool,
        expected_bit_depth: u8,
    ) -> Result<(), VolumeError> {
        let alike = alike && frame.rows() == self.rows && frame.columns() == self.columns;
        let place = (index, self.frames, self.columns);
        match (&self.bands, frame.samples()) {
            (Bands::U8(bands), Samples::U8(source)) if alike => scatter(bands, source, place),
            (Bands::U16(bands), Samples::U16(source)) if alike => scatter(bands, source, place),
            _ => {
                let expected =
                    FrameFormat { rows: self.rows, columns: self.columns, bit_depth: expected_bit_depth };
                return Err(VolumeError::Unlike { index, found: frame.format(), expected });
            }
        }
        Ok(())
    }
}

/// Copies the rows of frame `index` to their places in the bands.
fn scatter<T: Copy>(
    bands: &[Mutex<&mut [T]>],
    source: &[T],
    (index, frames, columns): (usize, usize, usize),
) {
    for (band, rows) in bands.iter().zip(source.chunks((BAND_ROWS * columns).max(1))) {
        // A thread that panicked here has left samples, which are all that is to be protected.
        let mut band = band.lock().unwrap_or_else(PoisonError::into_inner);
        for (epi, row) in band.chunks_exact_mut(frames * columns).zip(rows.chunks_exact(columns)) {
            epi[index * columns..(index + 1) * columns].copy_from_slice(row);
        }
    }
}
