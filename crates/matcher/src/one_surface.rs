//! Whether two disparities belong to one surface: the one answer of all stations.
//!
//! Neighbours on a surface differ by its slant and by the errors of what is known. A search errs by
//! up to half its window beside step edges and sees steep surfaces badly; what has been fitted is known
//! better, and its slants, too.

/// How much the disparities of one surface differ at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OneSurface {
    /// At the same place, in px.
    pub(crate) step_px: f32,
    /// And for each px between two places, in px.
    pub(crate) slant: f32,
}

impl OneSurface {
    /// Of the disparities of a search, and of a fit beside another surface.
    pub(crate) const ROUGH: Self = Self { step_px: 1.0, slant: 0.5 };
    /// Of guesses that a fit joins.
    pub(crate) const FINE: Self = Self { step_px: 0.5, slant: 0.3 };

    /// Whether disparities that differ by this, in px, at places so far apart belong to it.
    pub(crate) fn holds(self, difference_px: f32, distance_px: f32) -> bool {
        difference_px.abs() <= self.slack_px(distance_px)
    }

    /// The largest difference at places so far apart, in px.
    pub(crate) fn slack_px(self, distance_px: f32) -> f32 {
        self.step_px + self.slant * distance_px
    }
}
