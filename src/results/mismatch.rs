//! Results and the sequence that they claim to be of.

use std::path::PathBuf;

use epirig_core::fault::{Blame, Fault};
use epirig_core::shell::quoted;
use thiserror::Error;

/// Results that do not fit their sequence.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ResultsMismatch {
    /// Results of another sequence.
    #[error(
        "{} are results of another sequence; match {} again, or name its results with --results",
        results.display(), sequence.display()
    )]
    OtherSequence {
        /// The folder of the results.
        results: PathBuf,
        /// The folder of the sequence.
        sequence: PathBuf,
    },
    /// The calibration is not the one that the results were made with.
    #[error(
        "{0} was calibrated again after it was matched; run `epirig match {0} --overwrite` again",
        quoted(sequence)
    )]
    OtherCalibration {
        /// The folder of the sequence.
        sequence: PathBuf,
    },
    /// The frames are not those that were matched.
    #[error(
        "frames of {0} were taken after it was matched; run `epirig match {0} --overwrite` again",
        quoted(sequence)
    )]
    OtherFrames {
        /// The folder of the sequence.
        sequence: PathBuf,
    },
    /// Maps of another size than the frames.
    #[error(
        "{}: the maps have {columns} x {rows} px, the matched frames {frame_columns} x {frame_rows}; match the sequence again",
        results.display()
    )]
    FrameSize {
        /// The folder of the results.
        results: PathBuf,
        /// Rows of the maps.
        rows: usize,
        /// Columns of the maps.
        columns: usize,
        /// Rows of the frames.
        frame_rows: usize,
        /// Columns of the frames.
        frame_columns: usize,
    },
    /// There is no such reference frame.
    #[error(
        "{}: match.json names frame {reference} as reference, but there are {frames} frames; match the sequence again",
        results.display()
    )]
    Reference {
        /// The folder of the results.
        results: PathBuf,
        /// The frame that is named.
        reference: usize,
        /// Number of frames.
        frames: usize,
    },
    /// The summary contradicts the maps.
    #[error(
        "{}: match.json has another distance ({told_mm} mm) than maps and calibration ({found_mm} mm); match the sequence again",
        results.display()
    )]
    Distance {
        /// The folder of the results.
        results: PathBuf,
        /// The distance in the summary.
        told_mm: f64,
        /// The distance that the maps give.
        found_mm: f64,
    },
}

impl Fault for ResultsMismatch {
    fn blame(&self) -> Blame {
        Blame::Data
    }
}
