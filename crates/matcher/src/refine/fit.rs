//! The options of the fit.

use super::local_surface::Sizes;
use crate::lines::SeenRule;

/// How the fit is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The discs in which the surface is fitted.
    pub sizes: Sizes,
    /// Gauss-Newton steps; 0 leaves the disparity and only states its sigma.
    pub steps: usize,
    /// Which frames count.
    pub rule: SeenRule,
    /// The largest squared deviation of a frame that agrees, as a share of the contrast around a point;
    /// `None` if points are not occluded.
    pub deviation_share: Option<f32>,
}
