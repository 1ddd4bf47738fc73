//! The stage axis and the position of every frame, from the tracks of a rigid target.
//!
//! The model is the paper's (section 5.2): the stage axis is the same for all frames, so two angles rectify
//! them all. Beyond the paper, everything that the tracks depend on is found together, by bundle adjustment:
//! the lens (with its prior), the two angles, the place and depth of every corner, and the position of every
//! frame. So each standard deviation includes the uncertainty of all the others.

mod bundle;
mod direction;
mod find;
mod outline;
mod positioning_error;
mod scale;
#[cfg(test)]
mod tests;
mod vanishing;

use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use direction::Direction;
pub use find::find;
pub use outline::{Outline, outlines};
pub use positioning_error::{FramePosition, PositioningError, positioning_error};
pub use scale::{TargetScale, baseline_by_target};

use crate::lens::LensEstimate;
use epirig_core::least_squares::LeastSquaresError;

/// Why the stage axis cannot be found.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum StageAxisError {
    /// Too few corners that are seen in enough frames.
    #[error(
        "only {corners} corners of the target are seen in {frames} frames or more; at least {needed} are needed: have more of the \
         target in view, or larger squares"
    )]
    TooFewTracks {
        /// Corners that are.
        corners: usize,
        /// Frames in which a corner must be seen.
        frames: usize,
        /// Corners that are needed.
        needed: usize,
    },
    /// All corners move on one straight line, or nearly: the pan is open.
    #[error(
        "the corners all move on nearly the same line; have parts of the target above and below the object"
    )]
    OneLine,
    /// The scene does not move along the image's rows.
    #[error(
        "the target moves across the image's rows rather than along them; turn the camera by 90 degrees about its axis"
    )]
    NotAlongRows,
    /// A corner that the lens model cannot have seen.
    #[error(
        "the lens's distortion cannot be undone at column {x_px:.0}, row {y_px:.0}; calibrate the lens with boards that reach there"
    )]
    BeyondLens {
        /// Column, in px.
        x_px: f64,
        /// Row, in px.
        y_px: f64,
    },
    /// The prior of the lens is not valid.
    #[error("the covariance of the lens is not valid; calibrate the lens again")]
    BadLens,
    /// The bundle adjustment failed.
    #[error("the target's tracks do not fit a straight axis: {0}; check that target and camera are fixed")]
    Adjust(#[from] LeastSquaresError),
}

/// One corner of the target as the axis shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisPoint {
    /// Its index in the tracks.
    pub corner: usize,
    /// Rectified x of its ray at tau = 0, over the focal length.
    pub x: f64,
    /// Rectified y of its ray, over the focal length.
    pub y: f64,
    /// Its disparity over the whole baseline, over the focal length.
    pub disparity: f64,
}

/// Residual of an observation: its distance from its track after rectification.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrackResidual {
    /// Frame, from 0.
    pub frame: usize,
    /// Index of the corner in the tracks.
    pub corner: usize,
    /// Rectified column, in px from the principal point.
    pub column_px: f64,
    /// Column measured less column predicted, in px.
    pub along_px: f64,
    /// Row measured less row of the track, in px.
    pub across_px: f64,
}

/// The position of the stage in a frame, as the target shows it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredTau {
    /// Position on the baseline.
    pub tau: f64,
    /// Its standard deviation; 0 for the first and the last frame that show the target, which are the scale.
    pub sigma: f64,
}

/// The stage axis as the tracks show it.
#[derive(Debug, Clone, PartialEq)]
pub struct StageAxis {
    /// The two angles.
    pub direction: Direction,
    /// Standard deviation of the rotation about the optical axis, in rad.
    pub roll_sigma_rad: f64,
    /// Standard deviation of the pan, in rad.
    pub pan_sigma_rad: f64,
    /// The lens, as the tracks have refined it.
    pub lens: LensEstimate,
    /// tau of every frame that shows the target, on a scale on which the first and the last of them have the
    /// tau that the stage reported.
    pub tau: Vec<Option<MeasuredTau>>,
    /// The corners that were used.
    pub points: Vec<AxisPoint>,
    /// Every observation that counted.
    pub residuals: Vec<TrackResidual>,
    /// Observations that lie more than 4.5 standard deviations from their tracks and do not count: frame and
    /// corner.
    pub rejected: Vec<(usize, usize)>,
    /// Standard deviation of a coordinate of a corner, as the tracks show it, over that which the corners'
    /// own fits state.
    pub noise_factor: f64,
}

impl StageAxis {
    /// Root mean square of the distances of all observations from their rows, after rectification, in px.
    pub fn rows_rms_px(&self) -> f64 {
        let squares: f64 = self.residuals.iter().map(|residual| residual.across_px.powi(2)).sum();
        (squares / self.residuals.len().max(1) as f64).sqrt()
    }
}
