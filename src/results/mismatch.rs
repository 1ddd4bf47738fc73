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
        "{sequence} was calibrated again after it was matched; run `epirig match {sequence} --overwrite` again",
        sequence = quoted(.0)
    )]
    OtherCalibration(PathBuf),
    /// The frames are not those that were matched.
    #[error(
        "frames of {sequence} were taken after it was matched; run `epirig match {sequence} --overwrite` again",
        sequence = quoted(.0)
    )]
    OtherFrames(PathBuf),
    /// Maps of another size than the frames.
    #[error(
        "{}: the maps have {} x {} px, the matched frames {} x {}; match the sequence again",
        results.display(), maps.1, maps.0, frames.1, frames.0
    )]
    FrameSize {
        /// The folder of the results.
        results: PathBuf,
        /// Rows and columns of the maps.
        maps: (usize, usize),
        /// Rows and columns of the frames.
        frames: (usize, usize),
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
