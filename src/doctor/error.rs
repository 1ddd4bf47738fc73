//! Why a rig could not be examined, or something could not be measured.

use thiserror::Error;

use epirig_calibration::registration::ShiftError;
use epirig_devices::camera::CameraError;
use epirig_devices::stage::StageError;

/// Why nothing could be found out.
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
    #[error("a plan of {0} position(s) makes no sequence; give at least 2")]
    EmptyPlan(usize),
}

/// Why something could not be measured.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The stage failed.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The camera failed.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// Two pictures could not be compared.
    #[error(transparent)]
    Shift(#[from] ShiftError),
    /// There is no way to go.
    #[error("there is no way to go between {from_mm} mm and {last_mm} mm; choose positions that rise")]
    NoRoom {
        /// Where the stage is, in mm from home.
        from_mm: f64,
        /// Where it may go, in mm from home.
        last_mm: f64,
    },
}
