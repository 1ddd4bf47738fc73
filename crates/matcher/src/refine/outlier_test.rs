//! Outlier test: pixels beside another surface whose frames deviate from their line.
//!
//! They are occluded in more frames than geometry tells, or show both surfaces at once.

use super::mixed_pixels::{APART_PX, BESIDE_PX};
use super::padded::PAD;
use super::planes::ObservationMaps;
use crate::contrast::contrast;
use crate::lines::EpiLines;
use epirig_core::grid::Grid;
use epirig_core::volume::Volume;

/// Residuals are too large if their variance is this many times the largest squared deviation of a frame that
/// agrees: ten times what is typical of the scene.
const RESIDUAL_SHARE: f32 = 2.5;
/// Times the variance of the noise that is no outlier: with few frames chance doubles it now and then.
const RESIDUAL_NOISE: f32 = 4.0;

/// Says which pixels of row `y` are outliers, from their observations and the guesses that these start from.
pub(super) fn outliers_of_row(
    volume: &Volume,
    lines: &EpiLines,
    (observations, guess): (&ObservationMaps, &Grid<f32>),
    deviation_share: f32,
    y: usize,
    outliers: &mut [bool],
) {
    let mut row = vec![0.0; volume.columns()];
    volume.copy_row(y, lines.reference(), &mut row);
    let guesses = guess.row(y);
    let (residual, noise) = (observations.residual.row(y), observations.noise.row(y));
    for (x, (contrast, outlier)) in contrast(&row).zip(outliers).enumerate() {
        let agreeing = deviation_share * contrast;
        let unlike = residual[PAD + x] > RESIDUAL_SHARE * agreeing + RESIDUAL_NOISE * noise[PAD + x];
        *outlier = unlike && is_beside_another(guesses, x);
    }
}

/// Whether a neighbour lies on another surface, or has no guess.
fn is_beside_another(guesses: &[f32], x: usize) -> bool {
    let near = &guesses[x.saturating_sub(BESIDE_PX)..(x + BESIDE_PX + 1).min(guesses.len())];
    near.iter().any(|other| other.is_nan() || (other - guesses[x]).abs() > APART_PX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::padded::Padded;
    use epirig_core::tau::Tau;

    const COLUMNS: usize = 40;
    const SHARE: f32 = 0.2;
    const NOISE: f32 = 0.5;
    /// Nine pixels of 10 and 16 by turns vary by 10: 5 * 4 / 9 * 6^2 / 8. So 2.5 times a fifth of it, and
    /// four times the noise.
    const LIMIT: f32 = 2.5 * 0.2 * 10.0 + 4.0 * 0.5;

    /// Whether each pixel is an outlier if its residuals are `residual`, in the second of three rows.
    fn outliers(guesses: &[f32], residual: impl Fn(usize) -> f32) -> Vec<bool> {
        let mut volume = Volume::fine(3, COLUMNS, 8, Tau::equidistant(5).unwrap());
        for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
            let (x, y, t) = (index % COLUMNS, index / COLUMNS / 5, index / COLUMNS % 5);
            let stripes = if x % 2 == 0 { 10 } else { 16 };
            // Nothing but the row and the frame in question has contrast.
            *count = 128 * if (y, t) == (1, 2) { stripes } else { 50 };
        }
        let lines = EpiLines::new(volume.tau(), 2, COLUMNS);
        let mut observations = ObservationMaps::empty(3, COLUMNS);
        for x in 0..COLUMNS {
            observations.residual.row_mut(1)[PAD + x] = residual(x);
        }
        observations.noise = Padded::filled(3, COLUMNS, NOISE);
        let mut guess = Grid::filled(3, COLUMNS, 7.0);
        guess.row_mut(1).copy_from_slice(guesses);
        let mut outliers = vec![false; COLUMNS];
        outliers_of_row(&volume, &lines, (&observations, &guess), SHARE, 1, &mut outliers);
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
