//! Errors of the doctor and of single measurements.

use thiserror::Error;

use epirig_calibration::registration::ShiftError;
use epirig_core::fault::{Blame, Fault};
use epirig_devices::camera::CameraError;
use epirig_devices::stage::StageError;

/// Error that prevents the examination.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DoctorError {
    /// The stage failed.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The camera failed.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The plan has fewer than two positions.
    #[error("a plan of {0} position(s) is too short; give at least 2")]
    EmptyPlan(usize),
}

impl Fault for DoctorError {
    fn blame(&self) -> Blame {
        match self {
            Self::Stage(error) => error.blame(),
            Self::Camera(error) => error.blame(),
            Self::EmptyPlan(_) => Blame::Request,
        }
    }
}

/// Error of a single measurement.
#[derive(Debug, Error)]
pub(super) enum MotionError {
    /// The stage failed.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The camera failed.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// Two frames cannot be compared.
    #[error(transparent)]
    Shift(#[from] ShiftError),
    /// The range is empty.
    #[error("no room for a move between {from_mm} mm and {last_mm} mm; choose increasing positions")]
    NoRoom {
        /// Start of the move, in mm from home.
        from_mm: f64,
        /// Limit of the move, in mm from home.
        last_mm: f64,
    },
}
