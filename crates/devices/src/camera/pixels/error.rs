//! Why the bytes of a buffer do not form a frame.

use thiserror::Error;

use super::format::PixelFormat;
use epirig_core::frame::FrameError;

/// The bytes of a buffer do not form a frame.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PixelError {
    /// The image has no rows or no columns, or a mosaic has no complete cell.
    #[error("an image of {rows} rows x {columns} columns gives no pixel; choose a larger frame size")]
    Empty {
        /// Rows of the image.
        rows: usize,
        /// Columns of the image.
        columns: usize,
    },
    /// The stride is less than the length of a row.
    #[error(
        "the driver reports a stride of {found} bytes, but a row of {columns} columns in format {format} has {least} bytes; \
         choose another frame size or pixel format"
    )]
    Stride {
        /// The pixel format.
        format: PixelFormat,
        /// Columns of the image.
        columns: usize,
        /// Bytes of a row without padding.
        least: usize,
        /// The reported stride, in bytes.
        found: usize,
    },
    /// The buffer is too short for the image.
    #[error(
        "the camera sent {found} bytes of a frame of {expected}: part of it was lost; use a better cable, another USB port \
         or a lower frame rate"
    )]
    TooShort {
        /// Bytes of a whole image.
        expected: usize,
        /// Bytes received.
        found: usize,
    },
    /// A sample has more bits than its format.
    #[error(
        "the camera sent a sample of {maximum} in format {format}, which has {} bit: the frame is damaged, or the driver puts its \
         samples at the high end of their words; choose another pixel format if every frame is like this", format.bit_depth()
    )]
    AboveDepth {
        /// The pixel format.
        format: PixelFormat,
        /// The largest sample found.
        maximum: u16,
    },
    /// The bytes are not a complete JPEG image of the configured size.
    #[error(
        "the camera's JPEG image cannot be used: {0}; if it happens again, use a better cable, a lower frame rate or an \
         uncompressed pixel format"
    )]
    Jpeg(String),
    /// The samples do not form a frame.
    #[error("the camera's samples do not form a frame: {0}")]
    Frame(#[from] FrameError),
}
