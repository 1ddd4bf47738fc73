//! Why a simulator cannot be made, or has no answer.

use thiserror::Error;

use epirig_core::fault::{Blame, Fault};
use epirig_core::tau::TauError;
use epirig_core::volume::VolumeError;

/// Why a simulator cannot be made or asked.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SimulatorError {
    /// A number outside its values.
    #[error("the simulator's {what} is {value}, but must be {expected}")]
    BadNumber {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The values allowed.
        expected: &'static str,
    },
    /// Part of the surface could be occluded by another part in some frame, and its truth has no closed form
    /// then.
    #[error(
        "the simulator's scene would occlude part of itself in some frame: {0}; make it flatter or farther"
    )]
    OccludesItself(&'static str),
    /// Positions that make no baseline.
    #[error(transparent)]
    Tau(#[from] TauError),
    /// Frames that do not make a volume.
    #[error(transparent)]
    Volume(#[from] VolumeError),
    /// The camera is turned or distorts, so that its own frames show no disparities along rows.
    #[error(
        "the simulator's camera is turned or distorts; ask for the truth of a rectified view of it (`truth_seen_by`)"
    )]
    NotRectified,
    /// A frame that does not exist.
    #[error("the simulator's scan has no frame {index}; the last is {last}")]
    NoSuchFrame {
        /// The index given.
        index: usize,
        /// Last index.
        last: usize,
    },
}

/// Refuses a number that does not fit.
pub(super) fn require(
    fits: bool,
    what: &'static str,
    value: f64,
    expected: &'static str,
) -> Result<(), SimulatorError> {
    if fits { Ok(()) } else { Err(SimulatorError::BadNumber { what, value, expected }) }
}

/// Refuses a number that is not positive, or infinite.
pub(super) fn require_positive(what: &'static str, value: f64) -> Result<(), SimulatorError> {
    require(value.is_finite() && value > 0.0, what, value, "positive")
}

impl Fault for SimulatorError {
    fn blame(&self) -> Blame {
        Blame::Request
    }
}
