//! What is known of the surface and of the camera before.

/// What surfaces are looked for in a disc.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shapes {
    /// Planes alone.
    Planes,
    /// Planes, and planes with edges through them.
    PlanesAndEdges,
}

/// Edges of one family.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EdgePrior {
    /// Share of the discs that have one.
    pub(super) share: f64,
    /// Variance of its alpha: of the height of a step edge in px^2, or of the change of slant at a
    /// crease in (px/px)^2.
    pub(super) variance: f64,
}

/// Those of step edges, of creases and of grooves.
pub(super) type EdgePriors = [EdgePrior; 3];

/// What is known of the surface and of the camera before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Model {
    /// Surfaces in the small discs, and in the larger ones.
    pub(super) shapes: [Shapes; 2],
    /// Variance of the point spread of lens and aperture, in px^2.
    pub(super) blur: f32,
    /// Pixels whose mean precision is less, in 1/px^2, show no more texture than noise does.
    pub(super) least_texture: f32,
    /// Larger discs are used where the variance exceeds this, in px^2; infinite: nowhere.
    pub(super) wanted_variance: f32,
}
