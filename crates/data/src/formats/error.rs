//! Why bytes cannot be decoded as a map, or a map cannot be encoded.

use thiserror::Error;

/// Why bytes cannot be decoded as a map, or a map cannot be encoded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The bytes do not follow the format.
    #[error("not a {format} map of 32-bit floats: {reason}")]
    Malformed {
        /// The format expected.
        format: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// The format needs what is not known of the map.
    #[error("{format} cannot hold this map: {reason}")]
    Unsuitable {
        /// The format asked for.
        format: &'static str,
        /// What is missing, and what to do.
        reason: &'static str,
    },
}

/// The error for bytes that do not follow `format`.
pub(super) fn malformed(format: &'static str, reason: impl ToString) -> FormatError {
    FormatError::Malformed { format, reason: reason.to_string() }
}
