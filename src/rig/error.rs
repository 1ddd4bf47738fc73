//! Errors of a rig described by a profile.

use std::path::PathBuf;

use thiserror::Error;

use epirig_core::fault::{Blame, Fault};
use epirig_devices::camera::CameraError;
use epirig_devices::stage::StageError;
use epirig_simulator::SimulatorError;

/// Error when the rig of a profile is opened, or its plan is read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RigError {
    /// A value that the device does not accept.
    #[error("{key}: {reason}")]
    Value {
        /// The key.
        key: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// The plan lacks the step or the number of frames: the missing keys, with their verb.
    #[error(
        "{0} not known: set them in [plan] of the rig profile (remove the #), or give --step-mm and --frames. Without a profile: \
         `epirig init` writes one, and `--rig sim` simulates a rig"
    )]
    NoPlan(&'static str),
    /// Board frames are planned, but the board is not described.
    #[error(
        "plan.board asks for frames of a chess-board that is not described: set square, columns and rows in [board] of the rig \
         profile, or plan.board = 0"
    )]
    NoBoard,
    /// The simulated tile has other chess-boards than the profile.
    #[error(
        "the simulated tile has chess-boards along its upper and its lower edge: set target.bands = 2 and target.band_distance = \
         \"{band_distance_mm} mm\", or remove target.square, columns and rows"
    )]
    OtherBands {
        /// Distance from the first row of the upper board to that of the lower, in mm.
        band_distance_mm: f64,
    },
    /// A simulated camera that is too large.
    #[error("a simulated camera of {columns}x{rows} is too large; take 10000x10000 or less")]
    TooLarge {
        /// Columns of a frame.
        columns: usize,
        /// Rows of a frame.
        rows: usize,
    },
    /// A scan that no simulator made.
    #[error("{} was not taken by a simulated rig, so nobody knows its truth", .0.display())]
    NotSimulated(PathBuf),
    /// A simulated camera whose frames are not rectified.
    #[error("the camera of {} is turned or distorts; calibrate the sequence, and its rectified frames have a truth", .0.display())]
    NotCalibrated(PathBuf),
    /// A simulated scan that lacks frames.
    #[error("{} has {frames} of {planned} frames, and the truth is that of all; resume the scan", folder.display())]
    IncompleteScan {
        /// The folder of the sequence.
        folder: PathBuf,
        /// Frames that are there.
        frames: usize,
        /// Frames that were planned.
        planned: usize,
    },
    /// An impossible simulation.
    #[error(transparent)]
    Simulator(#[from] SimulatorError),
    /// The stage.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
}

impl Fault for RigError {
    fn blame(&self) -> Blame {
        match self {
            Self::Stage(error) => error.blame(),
            Self::Camera(error) => error.blame(),
            Self::Simulator(error) => error.blame(),
            Self::Value { .. }
            | Self::NoPlan { .. }
            | Self::NoBoard
            | Self::OtherBands { .. }
            | Self::NotSimulated(_)
            | Self::NotCalibrated(_)
            | Self::IncompleteScan { .. }
            | Self::TooLarge { .. } => Blame::Request,
        }
    }
}
