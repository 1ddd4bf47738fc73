//! Decodes the bytes of a V4L2 buffer to a grey frame.
//!
//! Samples are kept as stored: luma of YUV formats and of JPEG is not stretched to full scale, even if the
//! camera uses only 16 to 235, and no transfer function is inverted.

mod bayer;
mod error;
mod format;
mod four_cc;
mod grey;
mod jpeg;
mod unpack;

use epirig_core::frame::{Frame, FrameError, Samples};

pub use bayer::BayerUse;
pub use error::PixelError;
pub use format::PixelFormat;
use format::{SampleCoding, Storage};
pub use four_cc::{FourCc, FourCcError};

/// Layout of a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// The pixel format.
    pub format: PixelFormat,
    /// Rows of the image; for a mosaic, of the mosaic itself.
    pub rows: usize,
    /// Columns of the image; for a mosaic, of the mosaic itself.
    pub columns: usize,
    /// Bytes from the start of a row to that of the next (of luma, if planes follow); ignored for JPEG.
    pub stride: usize,
    /// Use of a mosaic; ignored for other formats.
    pub bayer: BayerUse,
}

impl Layout {
    /// Rows, columns and bit depth of the frames that [`Layout::decode`] gives.
    pub fn frame_shape(&self) -> (usize, usize, u8) {
        let depth = self.format.bit_depth();
        if self.format.is_bayer() {
            (self.rows / 2, self.columns / 2, self.bayer.depth_and_shift(depth).0)
        } else {
            (self.rows, self.columns, depth)
        }
    }

    /// The grey frame in `bytes`, which may be longer than the image. The padding of the stride is required
    /// for the last row too.
    ///
    /// JPEG is checked strictly: baseline, in one scan, of exactly the layout's size, with only zeros after
    /// its end, and with all blocks in the compressed data. Damage in the middle is found only if it gives an
    /// invalid code or changes the number of blocks; the format has no checksum.
    ///
    /// # Errors
    /// [`PixelError`] if the layout is impossible, the buffer is too short, a sample has more bits than its
    /// format, or a JPEG image is incomplete.
    pub fn decode(&self, bytes: &[u8]) -> Result<Frame, PixelError> {
        let (rows, columns, bit_depth) = self.frame_shape();
        if rows == 0 || columns == 0 {
            return Err(PixelError::Empty { rows: self.rows, columns: self.columns });
        }
        let samples = match (self.format.least_stride(self.columns), self.whole_image(bytes)?) {
            (Some(least), Some(image)) => {
                self.samples(image.chunks_exact(self.stride).map(|row| &row[..least]))?
            }
            _ => Samples::U8(jpeg::whole_luma(bytes, rows, columns).map_err(PixelError::Jpeg)?),
        };
        Frame::new(rows, columns, bit_depth, samples).map_err(|error| match error {
            FrameError::BitDepth { maximum, .. } => PixelError::AboveDepth { format: self.format, maximum },
            other => other.into(),
        })
    }

    /// The rows with their padding, without chroma planes; `None` for compressed formats.
    fn whole_image<'a>(&self, bytes: &'a [u8]) -> Result<Option<&'a [u8]>, PixelError> {
        let Self { format, rows, columns, stride, .. } = *self;
        let (Some(least), Some(expected)) = (format.least_stride(columns), format.image_bytes(rows, stride))
        else {
            return Ok(None);
        };
        if stride < least {
            return Err(PixelError::Stride { format, columns, least, found: stride });
        }
        match bytes.get(..rows.saturating_mul(stride)) {
            Some(image) if bytes.len() >= expected => Ok(Some(image)),
            _ => Err(PixelError::TooShort { expected, found: bytes.len() }),
        }
    }

    fn samples<'a>(&self, image: impl Iterator<Item = &'a [u8]>) -> Result<Samples, PixelError> {
        let Self { format, rows, columns, .. } = *self;
        Ok(match format.storage {
            Storage::Grey(SampleCoding::Byte) | Storage::PlanarLuma(_) => {
                Samples::U8(grey::bytes(image, columns, rows))
            }
            Storage::InterleavedLuma { first } => {
                Samples::U8(grey::interleaved_luma(first, image, columns, rows))
            }
            Storage::Grey(coding) => {
                let unpack = |row: &[u8], samples: &mut [u16]| unpack::samples(coding, row, samples);
                Samples::U16(grey::unpacked(image, columns, rows, unpack))
            }
            Storage::GreyBitPacked10 => {
                Samples::U16(grey::unpacked(image, columns, rows, unpack::bit_packed_10))
            }
            Storage::GreyBigEndian16 => {
                let unpack =
                    |row: &[u8], samples: &mut [u16]| unpack::words(row, samples, u16::from_be_bytes);
                Samples::U16(grey::unpacked(image, columns, rows, unpack))
            }
            Storage::Bayer { green_column, coding } => {
                let sums = bayer::sums(green_column, coding, self.bayer, format.bit_depth(), columns, image);
                Samples::U16(sums.map_err(|maximum| PixelError::AboveDepth { format, maximum })?)
            }
            Storage::Jpeg => return Err(PixelError::Jpeg("it has no rows of samples".to_owned())),
        })
    }
}

#[cfg(test)]
mod tests;
