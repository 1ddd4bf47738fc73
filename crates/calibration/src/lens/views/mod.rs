//! Lens calibration from views of a flat board, such as a chess-board in several poses.
//!
//! Views of a plane whose points are known determine the lens, if the plane is tilted differently in them
//! (Zhang 2000). A closed form gives a start, least squares over the lens and all poses the answer.

mod calibrate;
mod calibration;
mod choose;
mod error;
mod findings;
mod homography;
mod mapping;
mod point;
mod pose;
mod problem;
mod start;
mod terms;

pub use calibrate::calibrate;
pub use calibration::{Coverage, HeldOut, LensCalibration, PointName, PointResidual, ViewFit};
pub use choose::choose_terms;
pub use error::{LensError, LensWarning, with_view_named};
pub use point::{PlanarPoint, View};
pub use pose::BoardPose;
pub use terms::Terms;

#[cfg(test)]
mod tests;
