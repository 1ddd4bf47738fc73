//! What is known of the surface and of the camera before.

/// Guesses that differ by more from pixel to pixel are of two surfaces, in px/px.
pub(super) const STEEPEST: f32 = 0.3;

/// What surfaces are looked for in a disc.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shapes {
    /// Planes alone.
    Planes,
    /// Planes, and planes with one line through them.
    PlanesAndLines,
}

/// What is known of the surface and of the camera before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Model {
    /// Surfaces in the small discs, and in the larger ones.
    pub(super) shapes: [Shapes; 2],
    /// Lines of neighbouring directions lie this far apart at the rim of the disc, in px of the disc.
    pub(super) rim_px: f32,
    /// Odds that a line crosses a disc, before anything is observed.
    pub(super) line_odds: f32,
    /// Variance of the point spread of lens and aperture, in px^2.
    pub(super) blur: f32,
    /// Larger discs are used where the variance exceeds this, in px^2; infinite: nowhere.
    pub(super) wanted_variance: f32,
}
