//! Why an image file makes no frame.

use thiserror::Error;

/// Why an image file makes no frame.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ImageFault {
    /// The bytes do not follow their format.
    #[error("{0}")]
    Damaged(String),
    /// A sound file of a kind that is not read.
    #[error("{0}")]
    Unsupported(String),
    /// More pixels than can be measured.
    #[error("{columns} x {rows} pixels are more than can be measured (16384 x 16384)")]
    TooLarge {
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
    },
}

impl ImageFault {
    /// Fewer bytes than the pixels need.
    pub(super) fn cut_short() -> Self {
        Self::Damaged("it ends before its last pixel".to_owned())
    }
}

impl From<image::ImageError> for ImageFault {
    fn from(error: image::ImageError) -> Self {
        match error {
            image::ImageError::Unsupported(_) => {
                Self::Unsupported(format!("{error}; save it as a grey PNG of 8 or 16 bit"))
            }
            other => Self::Damaged(other.to_string()),
        }
    }
}
