//! What can be wrong with views of a board.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use epirig_core::least_squares::LeastSquaresError;

/// Why views give no lens. Views and points are counted from 0.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LensError {
    /// Too few views.
    #[error(
        "{views} views of the board are too few, {needed} are needed: take more, with the board tilted to different sides"
    )]
    TooFewViews {
        /// Views given.
        views: usize,
        /// Views needed.
        needed: usize,
    },
    /// A view with too few points.
    #[error(
        "view {view} shows {points} points of the board, at least {needed} are needed: leave it out or take it again"
    )]
    TooFewPoints {
        /// The view.
        view: usize,
        /// Its points.
        points: usize,
        /// Points needed.
        needed: usize,
    },
    /// A view whose points give no plane.
    #[error(
        "the points of view {view} lie on a line, on the board or as seen: leave it out, or take it again with more of the board in view"
    )]
    OnALine {
        /// The view.
        view: usize,
    },
    /// A point with numbers that cannot be.
    #[error(
        "point {point} of view {view} has a coordinate that is no number, or a standard deviation that is not above 0"
    )]
    NotAPoint {
        /// The view.
        view: usize,
        /// The point.
        point: usize,
    },
    /// The views do not tell focal length and distance apart.
    #[error(
        "the views leave the focal length open ({}): tilt the board by 20 to 40 deg, to the left, to the right, up and down",
        open(*sigma_share, *spread_rad)
    )]
    PosesAlike {
        /// Standard deviation of the focal length as a share of it; `None` if there is no telling.
        sigma_share: Option<f64>,
        /// Largest angle between the boards of any two views, in rad; `None` if there is no telling.
        spread_rad: Option<f64>,
    },
    /// Most of a view is wrong.
    #[error(
        "view {view} fits to no lens together with the other views ({rejected} of its {points} points are off): leave it out. It may be \
         blurred, of another board, or its points may be numbered wrongly"
    )]
    ViewWrong {
        /// The view.
        view: usize,
        /// Its points that are off.
        rejected: usize,
        /// Its points.
        points: usize,
    },
    /// The search for the lens has failed.
    #[error(
        "no lens was found that fits the views: {0}; check that the size of the squares and the order of the points are right"
    )]
    Search(#[source] LeastSquaresError),
}

impl LensError {
    /// The view that it is about, if it is about one.
    pub fn view(&self) -> Option<usize> {
        match *self {
            Self::TooFewPoints { view, .. }
            | Self::OnALine { view }
            | Self::NotAPoint { view, .. }
            | Self::ViewWrong { view, .. } => Some(view),
            Self::TooFewViews { .. } | Self::PosesAlike { .. } | Self::Search(_) => None,
        }
    }
}

impl LensWarning {
    /// The view that it is about, if it is about one.
    pub fn view(&self) -> Option<usize> {
        match *self {
            Self::ViewStandsOut { view, .. } => Some(view),
            Self::FocalLengthOpen { .. } | Self::CornersNotReached { .. } => None,
        }
    }
}

/// The message of an error or a warning with `name` instead of the number of its view.
pub fn with_view_named(message: &impl std::fmt::Display, view: Option<usize>, name: &str) -> String {
    let message = message.to_string();
    view.map_or(message.clone(), |view| message.replacen(&format!("view {view}"), name, 1))
}

impl From<LeastSquaresError> for LensError {
    fn from(error: LeastSquaresError) -> Self {
        match error {
            // Every view by itself determines its pose, so it is the focal length that is open.
            LeastSquaresError::Undetermined { .. } => {
                Self::PosesAlike { sigma_share: None, spread_rad: None }
            }
            other => Self::Search(other),
        }
    }
}

fn open(sigma_share: Option<f64>, spread_rad: Option<f64>) -> String {
    match (sigma_share, spread_rad) {
        (Some(share), Some(spread)) => format!(
            "it is known to {:.1} %, and the boards of any two views differ by at most {:.1} deg",
            100.0 * share,
            spread.to_degrees()
        ),
        _ => "all boards are parallel, or nearly so".to_owned(),
    }
}

/// A warning about a calibrated lens. Views are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Error)]
#[serde(tag = "warning", rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum LensWarning {
    /// The focal length is known badly.
    #[error(
        "the focal length is known to {:.2} % only: take views with the board tilted more (any two differ by at most {:.1} deg)",
        100.0 * sigma_share,
        spread_rad.to_degrees()
    )]
    FocalLengthOpen {
        /// Standard deviation of the focal length, as a share of it.
        sigma_share: f64,
        /// Largest angle between the boards of any two views, in rad.
        spread_rad: f64,
    },
    /// A view fits worse than the others.
    #[error(
        "view {view} fits worse than the others ({rms_px:.3} px, others {typical_px:.3} px; {rejected} of {points} points rejected): \
         look at it, it may be blurred"
    )]
    ViewStandsOut {
        /// The view.
        view: usize,
        /// Its root mean squared residual, in px.
        rms_px: f64,
        /// The median of all views, in px.
        typical_px: f64,
        /// Its points that were rejected.
        rejected: usize,
        /// Its points.
        points: usize,
    },
    /// The corners of the frame were not reached.
    #[error(
        "the points reach {:.0} % of the way from the middle of the frame to its corners: distortion beyond is extrapolated; \
         take views with the board near the edges",
        100.0 * radius
    )]
    CornersNotReached {
        /// Largest distance of a point from the middle, as a share of the corner's.
        radius: f64,
    },
}
