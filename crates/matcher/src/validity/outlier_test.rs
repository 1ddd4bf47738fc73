//! Outlier test: pixels beside another surface whose frames deviate from their line.
//!
//! They are occluded in more frames than geometry tells, or show both surfaces at once.

use crate::cost::contrast::contrast;
use crate::one_surface::OneSurface;

/// Pixels as far from another surface as this may show both, in px: as far as the rim's blur reaches.
pub(crate) const BESIDE_PX: usize = 2;
/// Surfaces whose disparities differ by more than this, in px, pass each other by more than their
/// blur: twice what one surface may have.
pub(crate) const SEPARATION_PX: f32 = 2.0 * OneSurface::ROUGH.step_px;
/// Residuals are too large if their variance is this many times the largest squared deviation of a frame that
/// agrees: ten times what is typical of the scene.
const RESIDUAL_SHARE: f32 = 2.5;
/// Times the variance of the noise that is no outlier: with few frames chance doubles it now and then.
const RESIDUAL_NOISE: f32 = 4.0;

/// What the outlier test knows of the pixels of a row.
pub(crate) struct TestedRow<'a> {
    /// Intensities of the reference frame, in DN.
    pub(crate) intensities: &'a [f32],
    /// The disparities that observations start from, in px; NaN where unknown.
    pub(crate) guesses: &'a [f32],
    /// Variance of the residuals, in DN^2.
    pub(crate) residual: &'a [f32],
    /// Variance of the noise, in DN^2.
    pub(crate) noise: &'a [f32],
}

impl TestedRow<'_> {
    /// Says which pixels are outliers, where frames that agree deviate by no more than `deviation_share` of
    /// the contrast.
    pub(crate) fn find_outliers(&self, deviation_share: f32, outliers: &mut [bool]) {
        for (x, (contrast, outlier)) in contrast(self.intensities).zip(outliers).enumerate() {
            let agreeing = deviation_share * contrast;
            let unlike = self.residual[x] > RESIDUAL_SHARE * agreeing + RESIDUAL_NOISE * self.noise[x];
            *outlier = unlike && is_beside_another(self.guesses, x);
        }
    }
}

/// Whether a neighbour lies on another surface, or has no guess.
fn is_beside_another(guesses: &[f32], x: usize) -> bool {
    let near = &guesses[x.saturating_sub(BESIDE_PX)..(x + BESIDE_PX + 1).min(guesses.len())];
    near.iter().any(|other| other.is_nan() || (other - guesses[x]).abs() > SEPARATION_PX)
}

#[cfg(test)]
mod tests {
    use super::*;
    const COLUMNS: usize = 40;
    const SHARE: f32 = 0.2;
    const NOISE: f32 = 0.5;
    /// Nine pixels of 10 and 16 by turns vary by 10: 5 * 4 / 9 * 6^2 / 8. So 2.5 times a fifth of it, and
    /// four times the noise.
    const LIMIT: f32 = 2.5 * 0.2 * 10.0 + 4.0 * 0.5;

    /// Whether each pixel is an outlier if its residuals are `residual`.
    fn outliers(guesses: &[f32], residual: impl Fn(usize) -> f32) -> Vec<bool> {
        let stripes: Vec<f32> = (0..COLUMNS).map(|x| if x % 2 == 0 { 10.0 } else { 16.0 }).collect();
        let residual: Vec<f32> = (0..COLUMNS).map(residual).collect();
        let noise = [NOISE; COLUMNS];
        let row = TestedRow { intensities: &stripes, guesses, residual: &residual, noise: &noise };
        let mut outliers = vec![false; COLUMNS];
        row.find_outliers(SHARE, &mut outliers);
        outliers
    }

    #[test]
    fn pixels_are_outliers_only_beside_another_surface() {
        // Another surface from 20 on, none at 30.
        let mut guesses = [7.0; COLUMNS];
        guesses[20..].fill(9.5);
        guesses[30] = f32::NAN;
        let found = outliers(&guesses, |_| 1.01 * LIMIT);
        for (x, &found) in found.iter().enumerate().take(COLUMNS - 4).skip(4) {
            // The pixel without a guess has no answer anyway.
            if x != 30 {
                assert_eq!(found, (18..22).contains(&x) || (28..33).contains(&x), "column {x}");
            }
        }
        assert!(!outliers(&guesses, |_| 0.99 * LIMIT)[4..COLUMNS - 4].contains(&true));
    }

    #[test]
    fn slants_are_no_other_surface() {
        // A pixel per pixel: two columns away lies no more than two pixels of disparity.
        let guesses: Vec<f32> = (0..COLUMNS).map(|x| x as f32).collect();
        assert!(!outliers(&guesses, |_| 1000.0).contains(&true));
    }

    #[test]
    fn each_pixel_is_an_outlier_by_its_own_residuals() {
        let mut guesses = [7.0; COLUMNS];
        guesses[20..].fill(-9.5);
        let found = outliers(&guesses, |x| if x == 19 { 1.01 * LIMIT } else { 0.0 });
        let outliers: Vec<usize> = (0..COLUMNS).filter(|&x| found[x]).collect();
        assert_eq!(outliers, [19]);
    }
}
