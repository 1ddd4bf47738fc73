//! How clear the texture around each pixel is.

use fearless_simd::Level;
use rayon::prelude::*;

use super::observed::Observed;
use super::pooling::{of_observed, pooled};
use crate::fit::padded::Padded;

/// Texture is averaged over a Gaussian of this standard deviation, in px: about the smallest disc.
const TEXTURE_PX: f32 = 2.0;

/// The mean of the precisions around each pixel, in 1/px^2.
pub(super) fn texture(level: Level, observed: &Observed) -> Padded {
    let mut texture = pooled(level, &observed.precision, TEXTURE_PX);
    let counts = pooled(level, &of_observed(observed, |_, _| 1.0), TEXTURE_PX);
    texture.values.par_iter_mut().zip(&counts.values).for_each(|(sum, count)| {
        // Where there is nothing, the sum is nothing, too.
        *sum /= count.max(f32::MIN_POSITIVE);
    });
    texture
}
