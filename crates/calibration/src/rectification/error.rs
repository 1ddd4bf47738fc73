//! Why frames cannot be rectified.

use thiserror::Error;

/// Why a mapping, a correction, frames and a volume do not go together.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RectifyError {
    /// No rectangle of rectified pixels lies in the raw image.
    #[error(
        "no part of a {columns} x {rows} frame is left after rectification; check lens, roll and pan of the calibration"
    )]
    NothingLeft {
        /// Rows of the raw frames.
        rows: usize,
        /// Columns of the raw frames.
        columns: usize,
    },
    /// A rectified pixel is seen by no pixel of the raw image.
    #[error(
        "the rectified pixel ({x}, {y}) lies outside the raw image; let the rectified size be chosen anew from the calibration"
    )]
    Outside {
        /// Column of the rectified pixel.
        x: usize,
        /// Row of the rectified pixel.
        y: usize,
    },
    /// The raw or the rectified image is too large for the table of places.
    #[error(
        "images of {columns} x {rows} are too large: at most 2^32 pixels can be rectified; check the sizes in the calibration"
    )]
    TooLarge {
        /// Rows of the image.
        rows: usize,
        /// Columns of the image.
        columns: usize,
    },
    /// A map of the correction has another size than the raw frames.
    #[error(
        "the {map} frame is {columns} x {rows}, the frames are {expected_columns} x {expected_rows}; take it again with \
         the camera's present format"
    )]
    CorrectionSize {
        /// The map: the subtracted ("dark") or the multiplied one ("gain").
        map: &'static str,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
        /// Rows of the raw frames.
        expected_rows: usize,
        /// Columns of the raw frames.
        expected_columns: usize,
    },
    /// A correction that is no number, or infinite.
    #[error(
        "the {map} frame has no finite value at ({x}, {y}); list that pixel as defective and give it any value"
    )]
    CorrectionValue {
        /// The map: the subtracted ("dark") or the multiplied one ("gain").
        map: &'static str,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
    },
    /// A defective pixel has no good neighbour to be replaced by, or lies outside the raw image.
    #[error(
        "the defective pixel ({x}, {y}) cannot be replaced: it lies outside the frame, or no good pixel is near"
    )]
    Defective {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
    },
    /// A frame of another size or bit depth than it must have.
    #[error(
        "frame {index} is {columns} x {rows} of {bit_depth} bit, expected is {expected_columns} x {expected_rows} of \
         {expected_bit_depth} bit; the calibration holds for one format of the camera only"
    )]
    Frame {
        /// Index of the frame in the volume.
        index: usize,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
        /// Its bit depth.
        bit_depth: u8,
        /// Rows of the raw frames.
        expected_rows: usize,
        /// Columns of the raw frames.
        expected_columns: usize,
        /// Bit depth of the volume.
        expected_bit_depth: u8,
    },
    /// The volume is not one that this mapping fills.
    #[error(
        "the volume has {frames} frames of {columns} x {rows}; {needed} fine frames of {expected_columns} x {expected_rows} \
         are needed"
    )]
    Volume {
        /// Frames of the volume.
        frames: usize,
        /// Rows of the volume.
        rows: usize,
        /// Columns of the volume.
        columns: usize,
        /// Frames that it needs at least.
        needed: usize,
        /// Rows of the rectified camera.
        expected_rows: usize,
        /// Columns of the rectified camera.
        expected_columns: usize,
    },
}
