//! A calibrated lens, with how well it fits.

use serde::{Deserialize, Serialize};

use super::error::LensWarning;
use super::pose::BoardPose;
use super::terms::Terms;
use crate::lens::estimate::LensEstimate;

/// A lens calibrated from views of a board, with the figures by which a person judges it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensCalibration {
    /// The lens and its covariance, which is scaled by [`variance_factor`](Self::variance_factor). A term
    /// that was not estimated has variance 0.
    pub estimate: LensEstimate,
    /// The terms that were estimated.
    pub terms: Terms,
    /// Root of the mean squared distance between points seen and predicted, in px, without the rejected; as
    /// OpenCV defines it.
    pub rms_px: f64,
    /// Sum of the squared residuals, in units of their stated standard deviations, over the degrees of
    /// freedom: 1 if these were right.
    pub variance_factor: f64,
    /// Residual of each point, by view and point.
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
    /// Warnings for a person.
    pub warnings: Vec<LensWarning>,
}

/// Residual of a point: where it was seen, less where it is predicted.
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

/// The error of a set of terms on views that had no part in finding the lens.
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
