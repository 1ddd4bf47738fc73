//! The disparities that are searched.

use serde::{Deserialize, Serialize};

/// A closed interval of disparities, in pixels over the whole baseline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DisparityRange {
    /// Smallest disparity, in px.
    pub minimum_px: f64,
    /// Largest disparity, in px.
    pub maximum_px: f64,
}

impl DisparityRange {
    /// Both ends times `factor`.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { minimum_px: factor * self.minimum_px, maximum_px: factor * self.maximum_px }
    }
}

/// The disparity candidates: equidistant from the smallest on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidates {
    minimum_px: f64,
    disparity_step_px: f64,
    count: usize,
}

impl Candidates {
    /// Multiples of `disparity_step_px` that cover `range`, so that a candidate does not depend on where the
    /// range begins.
    pub(crate) fn covering(range: DisparityRange, disparity_step_px: f64) -> Self {
        let first = (range.minimum_px / disparity_step_px + 1e-9).floor();
        let last = (range.maximum_px / disparity_step_px - 1e-9).ceil().max(first);
        Self { minimum_px: first * disparity_step_px, disparity_step_px, count: (last - first) as usize + 1 }
    }

    /// Number of candidates; at least one.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Step between neighbours, in px.
    pub fn disparity_step_px(&self) -> f64 {
        self.disparity_step_px
    }

    /// The disparity of candidate `index`, which may be fractional, in px.
    pub fn disparity_px(&self, index: f64) -> f64 {
        self.minimum_px + index * self.disparity_step_px
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_cover_the_range_at_fixed_steps() {
        let range = DisparityRange { minimum_px: -0.3, maximum_px: 1.1 };
        let candidates = Candidates::covering(range, 0.25);
        assert_eq!(candidates.count(), 8);
        assert_eq!(candidates.disparity_px(0.0), -0.5);
        assert_eq!(candidates.disparity_px(7.0), 1.25);
        let point = DisparityRange { minimum_px: 2.0, maximum_px: 2.0 };
        assert_eq!(Candidates::covering(point, 0.25).count(), 1);
    }
}
