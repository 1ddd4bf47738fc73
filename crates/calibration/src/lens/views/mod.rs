//! The lens from views of a flat board, such as a chess-board in several poses.
//!
//! Zhang (2000): views of a plane whose points are known determine the lens, if the plane is tilted differently in them. A closed form
//! gives a start, least squares over the lens and all poses the answer.

mod board_pose;
mod calibrate;
mod choose;
mod error;
mod findings;
mod homography;
mod problem;
mod start;

use serde::{Deserialize, Serialize};

use super::{Lens, LensEstimate};
pub use board_pose::{BoardPose, fit_pose};
pub use calibrate::calibrate;
pub use choose::choose_terms;
pub use error::{LensError, LensWarning};

/// A point of a flat board and where it was seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanarPoint {
    /// Place on the board, in mm.
    pub x_mm: f64,
    /// Place on the board, in mm.
    pub y_mm: f64,
    /// Column where it was seen, in px.
    pub x_px: f64,
    /// Row where it was seen, in px.
    pub y_px: f64,
    /// Standard deviation of column and row each, in px; above 0. A common factor does not matter.
    pub sigma_px: f64,
}

/// The points of the board that one frame shows; at least eight that are not on a line. They need not be all.
pub type View = Vec<PlanarPoint>;

/// Which terms of the distortion are estimated; the others are 0. Ordered from the simplest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Terms {
    /// None: a straight projection.
    None,
    /// Radial of second order.
    K1,
    /// Radial of second and fourth order.
    K1K2,
    /// These, and the two tangential ones.
    K1K2P1P2,
    /// All five, as OpenCV does unless told otherwise.
    All5,
}

impl Terms {
    /// All sets, from the simplest.
    pub const ALL: [Self; 5] = [Self::None, Self::K1, Self::K1K2, Self::K1K2P1P2, Self::All5];

    /// The parameters of the lens that are estimated, by their index in [`Lens::to_array`]: focal lengths and principal point always.
    pub fn estimated(self) -> std::ops::Range<usize> {
        0..4 + match self {
            Self::None => 0,
            Self::K1 => 1,
            Self::K1K2 => 2,
            Self::K1K2P1P2 => 4,
            Self::All5 => 5,
        }
    }

    /// The lens without the terms that are not estimated.
    pub(super) fn keep(self, lens: &Lens) -> Lens {
        let mut parameters = lens.to_array();
        parameters[self.estimated().end..].fill(0.0);
        Lens::from_array(parameters)
    }
}

/// A lens as views of a board have shown it, with what a person wants to see before trusting it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensCalibration {
    /// The lens and its covariance, which is scaled by [`variance_factor`](Self::variance_factor). A term that was not estimated has
    /// variance 0.
    pub estimate: LensEstimate,
    /// The terms that were estimated.
    pub terms: Terms,
    /// Root of the mean squared distance between points seen and predicted, in px, without the rejected; as OpenCV defines it.
    pub rms_px: f64,
    /// Sum of the squared residuals, in units of their stated standard deviations, over the degrees of freedom: 1 if these were right.
    pub variance_factor: f64,
    /// What is left of each point, by view and point.
    pub residuals: Vec<Vec<PointResidual>>,
    /// Where the board was, by view.
    pub poses: Vec<BoardPose>,
    /// How well each view fits.
    pub views: Vec<ViewFit>,
    /// How much of the frame the points reached.
    pub coverage: Coverage,
    /// Points that were left out, because they fit to no lens together with the others.
    pub rejected: Vec<PointName>,
    /// Sets of terms by their error on views that were held out; empty if the terms were given.
    pub cross_validation: Vec<HeldOut>,
    /// What a person should know.
    pub warnings: Vec<LensWarning>,
}

/// Where a point was seen, less where it is predicted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointResidual {
    /// Column where it was seen, in px.
    pub x_px: f64,
    /// Row where it was seen, in px.
    pub y_px: f64,
    /// Seen less predicted column, in px.
    pub dx_px: f64,
    /// Seen less predicted row, in px.
    pub dy_px: f64,
    /// Whether the point was left out.
    pub rejected: bool,
}

/// How well a view fits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewFit {
    /// Root of the mean squared distance between points seen and predicted, in px, without the rejected.
    pub rms_px: f64,
    /// Points.
    pub points: usize,
    /// Points that were left out.
    pub rejected: usize,
}

/// How much of the frame the points reached, the rejected not counted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coverage {
    /// Share of the cells of a 10 x 10 grid that hold a point, 0 to 1.
    pub cells: f64,
    /// Largest distance of a point from the middle of the frame, as a share of the corner's.
    pub radius: f64,
}

/// Names a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointName {
    /// Index of the view.
    pub view: usize,
    /// Index of the point in it.
    pub point: usize,
}

/// What a set of terms predicts of views that had no part in finding the lens.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldOut {
    /// The terms.
    pub terms: Terms,
    /// Root of the mean squared distance between points seen and predicted, in px.
    pub rms_px: f64,
    /// Mean over the views of the squared distance, less that of the best set, in px2.
    pub excess_px2: f64,
    /// Standard error of the excess, from its scatter between views, in px2; 0 for the best set.
    pub excess_error_px2: f64,
}

#[cfg(test)]
mod tests;
