//! Validity: which pixels have an answer, and if not, why.
//!
//! - `area`: pixels outside the mask have none.
//! - `visibility`: the frames that see a point, where nearer surfaces pass before it.
//! - `outlier_test`: pixels beside another surface whose frames deviate from their line.
//! - `rule`: the decision after the fit.
//! - `outline`: where the object is, around the answers.

pub(crate) mod area;
pub(crate) mod outlier_test;
mod outline;
pub(crate) mod rule;
pub(crate) mod visibility;

epirig_core::choices! {
    /// Whether a pixel has an answer, and if not, why.
    pub enum Validity {
        /// One line fits: the pixel has a disparity.
        Found = "found",
        /// Its line leaves the image in too many frames.
        LeavesImage = "leaves-image",
        /// The best line is at an end of the range that was searched.
        ///
        /// The right one may lie beyond it.
        BeyondRange = "beyond-range",
        /// Too uncertain: little texture, or no line fits.
        ///
        /// The sigma of the disparity exceeds the limit, or noise alone explains the gradients.
        NoTexture = "no-texture",
        /// It is occluded in too many frames, or shows two surfaces.
        Occluded = "occluded",
        /// Several lines fit about as well, or no neighbour agrees.
        Ambiguous = "ambiguous",
        /// It is outside the region or the mask of the match.
        Outside = "outside",
    }
}
