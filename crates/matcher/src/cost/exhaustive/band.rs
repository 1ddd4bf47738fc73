//! Bands of rows that share the samples of their neighbours.

use std::ops::Range;

use crate::cost::interpolation::SampledEpi;
use crate::options::MatchOptions;
use epirig_core::volume::Volume;

/// Rows that are matched together, with the rows around them that their windows reach.
pub(crate) struct Band {
    /// Rows of the volume whose samples are held.
    pub(super) paths: Range<usize>,
    /// Rows that are answered.
    pub(super) answered: Range<usize>,
    /// Half of the window's side, rounded down.
    pub(super) half: usize,
    /// The held rows, prepared for sampling.
    pub(super) epis: Vec<SampledEpi>,
}

impl Band {
    pub(crate) fn new(volume: &Volume, answered: Range<usize>, options: &MatchOptions) -> Self {
        let half = options.window_px / 2;
        let paths = answered.start.saturating_sub(half)..(answered.end + half).min(volume.rows());
        let epis = paths.clone().map(|y| SampledEpi::new(volume, y, options.interpolation, half)).collect();
        Self { paths, answered, half, epis }
    }

    /// The held rows, as indices into `epis`, that the window around answered row `index` covers.
    pub(super) fn window_rows(&self, index: usize) -> Range<usize> {
        let y = self.answered.start + index;
        let first = y.saturating_sub(self.half).max(self.paths.start);
        let end = (y + self.half + 1).min(self.paths.end);
        first - self.paths.start..end - self.paths.start
    }
}
