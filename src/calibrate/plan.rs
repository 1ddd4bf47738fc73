//! The plan of a calibration.

use epirig_calibration::lens::{Lens, LensEstimate};
use epirig_calibration::photometry::{ExposureLevel, PhotometryOptions};
use epirig_calibration::target::{ChessBoard, Target};

/// Knowledge of a rig besides its frames.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationPlan {
    /// The chess-boards on the object, if there are any.
    pub target: Option<Target>,
    /// The chess-board of the board frames.
    pub board: Option<ChessBoard>,
    /// Knowledge of the lens, used if there are no board frames.
    pub lens: Option<LensKnowledge>,
    /// Which brightness corrections are made.
    pub photometry: PhotometryOptions,
    /// Source of the position of every frame.
    pub positions: PositionSource,
    /// Flat frames at several exposures, to test the sensor's linearity; may be empty.
    pub exposures: Vec<ExposureLevel>,
    /// Whether rectified frames are held on disk while the calibration lasts, in the folder of the sequence, and not in
    /// memory. The calibration is the same.
    pub frames_on_disk: bool,
}

epirig_core::choices! {
    /// Source of the position of every frame.
    #[derive(Default)]
    pub enum PositionSource {
        /// The target where one is described; else the texture, where it tells more than the stage.
        #[default]
        Automatic = "auto",
        /// The target.
        Target = "target",
        /// The object's texture; scale and origin are the stage's.
        Texture = "texture",
        /// The stage's report.
        Stage = "stage",
    }
}

/// A lens that is known without board frames.
#[derive(Debug, Clone, PartialEq)]
pub enum LensKnowledge {
    /// From a file. It replaces board frames.
    File {
        /// Name of the file.
        name: String,
        /// The lens with its covariance.
        estimate: Box<LensEstimate>,
    },
    /// From a data sheet. Board frames replace it.
    DataSheet {
        /// The lens; distortion 0 if unknown.
        lens: Lens,
        /// Relative standard uncertainty of the focal length.
        focal_length_sigma: f64,
    },
}
