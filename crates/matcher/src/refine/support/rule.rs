//! Which observations belong to a pixel's surface.

/// Variance of a plane's disparity, including the disagreement of windows, over that of its slants, in px^2:
/// the mean square of u in windows 3 px wide. A larger value would carry slants across relief that they do
/// not show.
pub(super) const LEAST_SLANT_SPREAD: f32 = 2.0 / 3.0;

/// Which observations are joined, and how.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SupportRule {
    /// Neighbours up to this many columns and rows away take part.
    pub(crate) reach: (usize, usize),
    /// Two disparities belong to one plane if they differ by less than this many of their common sigmas.
    pub(crate) belongs_sigmas: f32,
    /// A plane's variance grows from the pixel by the squared distance over this, in px^2.
    pub(crate) slant_spread: f32,
    /// Further allowance for the difference of neighbours, in px, and for each px of their distance.
    pub(crate) slack: (f32, f32),
    /// Whether the slants of the map's planes are known as well as wider windows show them. Then neighbours
    /// of another slant do not belong, and a window hardly loses precision to its own slants: a square one
    /// would lose a fifth of its variance where texture is uneven, a small one more.
    pub(crate) slants_known: bool,
}
