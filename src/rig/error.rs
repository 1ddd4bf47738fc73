//! Why a profile describes no rig that can be opened.

use thiserror::Error;

use epirig_devices::camera::CameraError;
use epirig_devices::stage::StageError;
use epirig_simulator::SimulatorError;

/// Why the rig of a profile cannot be opened, or what it plans cannot be done.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RigError {
    /// A key says something that its device does not understand.
    #[error("{key}: {reason}")]
    Value {
        /// The key.
        key: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// The plan does not say how far the stage is to go, or how often.
    #[error(
        "{lacks} not known: set them in [plan] of the rig profile (take the # away), or give --step-mm and --frames. No profile yet? \
         `epirig init` writes one; `--rig sim` needs none, and no hardware"
    )]
    NoPlan {
        /// Which keys, with their verb.
        lacks: &'static str,
    },
    /// Frames of a board are planned, and no board is described.
    #[error(
        "plan.board asks for frames of a chess-board that is not described: set square, columns and rows in [board] of the rig \
         profile, or plan.board = 0"
    )]
    NoBoard,
    /// The simulated tile has other chess-boards than the profile describes.
    #[error(
        "the simulated tile has its chess-boards along its upper and its lower edge: set target.bands = 2 and target.band_distance = \
         \"{band_distance_mm} mm\", or leave target.square, columns and rows out"
    )]
    OtherBands {
        /// From the first row of the upper to the first row of the lower, in mm.
        band_distance_mm: f64,
    },
    /// A simulated camera beyond all sensors.
    #[error("a simulated camera of {columns}x{rows} is too large; take 10000x10000 or less")]
    TooLarge {
        /// Columns of a frame.
        columns: usize,
        /// Rows of a frame.
        rows: usize,
    },
    /// What is simulated cannot be.
    #[error(transparent)]
    Simulator(#[from] SimulatorError),
    /// The stage.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
}
