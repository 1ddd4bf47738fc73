//! What a calibration is to be made of.

use serde::{Deserialize, Serialize};

use epirig_calibration::lens::{Lens, LensEstimate};
use epirig_calibration::photometry::{ExposureLevel, PhotometryOptions};
use epirig_calibration::target::{ChessBoard, Target};

/// What is known of a rig before its frames are looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationPlan {
    /// The chess-boards on the object, if there are any.
    pub target: Option<Target>,
    /// The chess-board of the board frames.
    pub board: Option<ChessBoard>,
    /// What is known of the lens, if board frames do not tell.
    pub lens: Option<LensKnowledge>,
    /// What of the frames' brightness is corrected.
    pub photometry: PhotometryOptions,
    /// Where the position of every frame comes from.
    pub positions: PositionSource,
    /// Flat frames at several exposures, to judge the sensor's linearity by; may be empty.
    pub exposures: Vec<ExposureLevel>,
}

/// Where the position of every frame comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionSource {
    /// From the target where it is seen, else from the stage.
    #[default]
    Automatic,
    /// From the target.
    Target,
    /// From the object's texture, jointly with its disparity; scale and origin are the stage's.
    Texture,
    /// As the stage reported.
    Stage,
}

/// A lens that somebody has told us of.
#[derive(Debug, Clone, PartialEq)]
pub enum LensKnowledge {
    /// From a file, by this name. It replaces what board frames would tell.
    File {
        /// Name of the file.
        name: String,
        /// The lens with its covariance.
        estimate: Box<LensEstimate>,
    },
    /// From a data sheet: board frames tell better.
    DataSheet {
        /// The lens; distortion 0 for not known.
        lens: Lens,
        /// Standard deviation of the focal length as a share of it.
        focal_length_sigma: f64,
    },
}
