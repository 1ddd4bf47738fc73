//! The options of the search for two levels.

use crate::trend::TrendKind;

/// Parameters of the search, from the matcher and the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepsOptions {
    /// The trend under the levels.
    pub trend: TrendKind,
    /// Pixels nearer than this to the other level are left out: half the matcher's window, half a wall, and as far as
    /// the lens spreads light.
    pub margin_px: usize,
    /// Pixels nearer than this are left out, too, where enough remain; at least `margin_px`.
    pub grown_margin_px: usize,
    /// Hollows of fewer pixels are taken for noise.
    pub least_area_px: usize,
}

impl StepsOptions {
    /// For a matcher whose windows have this side, walls of up to two pixels, and a lens that spreads light by a pixel.
    pub fn for_window(trend: TrendKind, window_px: usize) -> Self {
        let margin_px = window_px / 2 + 2;
        // Twice as wide and high as the smallest that a pixel clear of the walls fits in.
        Self { trend, margin_px, grown_margin_px: margin_px, least_area_px: (2 * (2 * margin_px + 1)).pow(2) }
    }

    /// For a matcher whose windows grow to this side where noise asks for it.
    #[must_use]
    pub fn with_grown_window(self, window_px: usize) -> Self {
        Self { grown_margin_px: self.margin_px.max(window_px / 2 + 1), ..self }
    }

    /// Width of the rim of a field that is left out: beside textureless ground, windows give answers half a window
    /// beyond the edge of an object, and wrong ones half a window within it.
    pub fn rim_px(&self) -> usize {
        2 * self.grown_margin_px - 1
    }
}
