//! Pixels beside another surface whose frames show something else than their line says: they are hidden in more frames than was seen, or show
//! both surfaces at once.

use super::planes::{PAD, VotePlanes};
use crate::epi::contrast::contrast;
use crate::epi::lines::Lines;
use crate::plane::Plane;
use crate::volume::Volume;

/// Neighbours in the row that tell whether another surface is near, to both sides, in px: as far as the rim's blur reaches.
const BESIDE_PX: usize = 2;
/// Disparities that differ by more than this are of two surfaces, in px.
const APART_PX: f32 = 2.0;
/// Residuals are too large if their variance is this many times the largest squared deviation of a frame that agrees: ten times what is
/// typical of the scene.
const RESIDUAL_SHARE: f32 = 2.5;
/// Times the variance of the noise that is no reason for doubt: with few frames chance doubles it now and then.
const RESIDUAL_NOISE: f32 = 4.0;

/// Says which pixels of row `y` are doubtful, from their votes and the guesses that these are counted from.
pub(super) fn doubtful_row(
    volume: &Volume,
    lines: &Lines,
    (votes, guess): (&VotePlanes, &Plane<f32>),
    deviation_share: f32,
    y: usize,
    doubtful: &mut [bool],
) {
    let mut row = vec![0.0; volume.columns()];
    volume.copy_row(y, lines.reference(), &mut row);
    let guesses = guess.row(y);
    let (residual, noise) = (votes.residual.row(y), votes.noise.row(y));
    for (x, (contrast, doubtful)) in contrast(&row).zip(doubtful).enumerate() {
        let agreeing = deviation_share * contrast;
        let unlike = residual[PAD + x] > RESIDUAL_SHARE * agreeing + RESIDUAL_NOISE * noise[PAD + x];
        *doubtful = unlike && is_beside_another(guesses, x);
    }
}

/// Whether a neighbour lies on another surface, or has no guess.
fn is_beside_another(guesses: &[f32], x: usize) -> bool {
    let near = &guesses[x.saturating_sub(BESIDE_PX)..(x + BESIDE_PX + 1).min(guesses.len())];
    near.iter().any(|other| other.is_nan() || (other - guesses[x]).abs() > APART_PX)
}
