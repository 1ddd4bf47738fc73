//! How far a frame may deviate along the line of a right candidate.

/// A right candidate costs at most this many times the median of them: texture and the contrast around it are
/// not alike everywhere.
const COSTS_VARY: f32 = 2.0;

/// If frames deviate by half of the tolerance, a quarter in squares, a candidate is right whatever others
/// cost.
const ACCEPTED: f32 = 0.25;

/// Differences below this are not significant: half the square of a tenth of the tolerance.
pub(super) const LEAST_TYPICAL: f32 = 0.005;

/// The deviation allowed to a frame along the line of a right candidate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tolerance {
    /// Largest squared deviation of a frame that agrees, as a share of the contrast around the point.
    pub(super) share: f32,
    /// Cost of a right candidate that all frames see: mean squared deviation over the largest, the median of
    /// the image.
    pub(super) typical: f32,
}

impl Tolerance {
    /// Largest cost of a right candidate: one that only the share `min_visible` of the frames sees, but
    /// no less than one that all frames see may cost.
    pub(super) fn largest_cost(&self, min_visible: f64) -> f32 {
        let partly_occluded = 1.0 - min_visible as f32 * (1.0 - self.typical);
        let varying = (COSTS_VARY * self.typical).max(ACCEPTED);
        partly_occluded.max(varying).min(1.0)
    }
}
