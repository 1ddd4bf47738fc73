//! Which observations belong to a pixel's surface.

/// The variance of a plane's disparity, with what windows disagree by against what chance makes of it, over this is taken for that of its slants, in
/// px^2: the mean square of u in windows 3 px wide. Wider ones would hand slants on across what they do not see.
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
    /// Whether the map's planes have slants that are known as well as wider windows know them. Then neighbours of another slant do not belong, and slants cost a window next to nothing of what its observations
    /// tell of the disparity: of a square one a fifth in variance, where textures are uneven, and more of a small one.
    pub(crate) slants_known: bool,
}
