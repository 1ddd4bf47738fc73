//! The options of the fit.

use crate::lines::SeenRule;
use crate::options::{Effort, Surfaces};

/// How the fit is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// How observations are joined.
    pub surfaces: Surfaces,
    /// Side of the smallest window, in px, odd.
    pub window_px: usize,
    /// Wanted sigma in px: a window that leaves a larger one grows as far as it has to, up to 11 px, and on
    /// surfaces without relief up to 21 px.
    pub wanted_sigma_px: f64,
    /// With [`Effort::Quick`] windows are the smallest, centred on the pixel or beside it, and no other are
    /// tried.
    pub effort: Effort,
    /// Gauss-Newton steps; 0 leaves the disparity and only states its sigma.
    pub steps: usize,
    /// Which frames count.
    pub rule: SeenRule,
    /// The largest squared deviation of a frame that agrees, as a share of the contrast around a point;
    /// `None` if points are not occluded.
    pub deviation_share: Option<f32>,
}
