//! Why frames cannot be rectified.

use epirig_core::frame::FrameFormat;
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
        "the {map} frame is {} x {}, the frames are {} x {}; take it again with the camera's present format",
        found.1, found.0, expected.1, expected.0
    )]
    CorrectionSize {
        /// The map: the subtracted ("dark") or the multiplied one ("gain").
        map: &'static str,
        /// Its rows and columns.
        found: (usize, usize),
        /// Those of the raw frames.
        expected: (usize, usize),
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
        "frame {index} is {found}, expected is {expected}; the calibration holds for one format of the camera only"
    )]
    Frame {
        /// Index of the frame in the volume.
        index: usize,
        /// Its size and bit depth.
        found: FrameFormat,
        /// The size of the raw frames, and the bit depth of the volume.
        expected: FrameFormat,
    },
    /// The volume is not one that this mapping fills.
    #[error(
        "the volume has {frames} frames of {} x {}; {needed} fine frames of {} x {} are needed",
        found.1, found.0, expected.1, expected.0
    )]
    Volume {
        /// Frames of the volume.
        frames: usize,
        /// Its rows and columns.
        found: (usize, usize),
        /// Frames that it needs at least.
        needed: usize,
        /// Rows and columns of the rectified camera.
        expected: (usize, usize),
    },
    /// There are more frames than poses.
    #[error("{needed} frames need a pose each, there are {poses}; estimate the poses from these frames")]
    Poses {
        /// Poses given.
        poses: usize,
        /// Frames that need one, up to the last one that is put in.
        needed: usize,
    },
}
