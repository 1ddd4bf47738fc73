//! What can go wrong between a sequence and its results.

use thiserror::Error;

use crate::bands::BandError;
use crate::calibrate::CalibrateError;
use crate::report::ReportError;
use crate::results::{ResultsError, ResultsMismatch};
use epirig_core::fault::{Blame, Fault};
use epirig_core::progress::Cancelled;
use epirig_core::rows::RowsError;
use epirig_data::packed::PackedError;
use epirig_data::sequence::SequenceError;
use epirig_matcher::MatchError;
use epirig_matcher::evaluate::SplitHalfError;
use epirig_surface::SurfaceError;

/// Errors of calibration, matching and results.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PipelineError {
    /// The sequence cannot be read.
    #[error(transparent)]
    Sequence(#[from] SequenceError),
    /// The calibration fails, or does not match the sequence.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// The packed volume cannot be written or read.
    #[error(transparent)]
    Packed(#[from] PackedError),
    /// Rows of its frames cannot be read.
    #[error(transparent)]
    Rows(#[from] RowsError),
    /// Its bands cannot be planned, matched or merged.
    #[error(transparent)]
    Bands(#[from] BandError),
    /// It cannot be matched.
    #[error(transparent)]
    Match(#[from] MatchError),
    /// Its halves cannot be matched.
    #[error(transparent)]
    Halves(#[from] SplitHalfError),
    /// The results cannot be written or read.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// The results do not fit their sequence.
    #[error(transparent)]
    Mismatch(#[from] ResultsMismatch),
    /// The sequence has no such frame.
    #[error("the sequence has no frame {0}; run `epirig verify` on it")]
    NoSuchFrame(usize),
    /// A picture cannot be drawn.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The surface cannot be analysed.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Fault for PipelineError {
    fn blame(&self) -> Blame {
        match self {
            Self::Sequence(error) => error.blame(),
            Self::Calibrate(error) => error.blame(),
            Self::Packed(error) => error.blame(),
            Self::Rows(error) => error.blame(),
            Self::Bands(error) => error.blame(),
            Self::Match(error) | Self::Halves(SplitHalfError::Match(error)) => error.blame(),
            Self::Results(error) => error.blame(),
            Self::Report(error) => error.blame(),
            Self::Surface(error) => error.blame(),
            Self::Cancelled(error) => error.blame(),
            Self::Halves(_) | Self::Mismatch(_) | Self::NoSuchFrame { .. } => Blame::Data,
        }
    }
}
