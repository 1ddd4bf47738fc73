//! Whether light changes so much over the sequence that a search for the least variance follows it.
//!
//! A frame that is lighter by a share r shifts each line's cost by r^2 times the squared intensity,
//! and a search for the least variance finds the line along which the texture makes up for it. The
//! fit tells light from the surface if it starts near enough: up to a change of a fifth over the
//! sequence.

use epirig_core::statistics::upper_median;
use epirig_core::volume::Volume;
use rayon::prelude::*;

use super::linear_epi::LinearEpi;

/// The largest change that the fit takes from any start, as a share of the light.
const LARGEST_CHANGE: f32 = 0.2;
/// Rows that are looked at, spread over the image, in stretches of so many columns: their means
/// change little by what moves through them.
const SAMPLED_ROWS: usize = 48;
const STRETCH: usize = 32;
/// Stretches darker than this share of full scale do not count: noise hides their change.
const LEAST_LIGHT: f32 = 1.0 / 32.0;

/// Whether the light of the frames changes by more than the fit can tell from a disparity. From
/// frame to frame it changes as the median of all stretches does: what moves through some of them
/// is no light.
pub(crate) fn changes_much(volume: &Volume) -> bool {
    let rows = volume.rows().min(SAMPLED_ROWS);
    let least = LEAST_LIGHT * (1_u32 << volume.bit_depth()) as f32;
    let mean = |stretch: &[f32]| stretch.iter().sum::<f32>() / stretch.len() as f32;
    // Of each sampled row the means of its stretches, frame by frame.
    let means_of = |index: usize| {
        let epi = LinearEpi::new(volume, (2 * index + 1) * volume.rows() / (2 * rows));
        (0..volume.frames()).map(|t| epi.frame(t).chunks(STRETCH).map(mean).collect()).collect()
    };
    let means: Vec<Vec<Vec<f32>>> = (0..rows).into_par_iter().map(means_of).collect();
    let change = |t: usize| {
        let pairs = means.iter().flat_map(|of_row| of_row[t - 1].iter().zip(&of_row[t]));
        let bright = pairs.filter(|(before, after)| **before > least && **after > least);
        upper_median(&mut bright.map(|(before, after)| after / before).collect::<Vec<f32>>()).unwrap_or(1.0)
    };
    let changes: Vec<f32> = (1..volume.frames()).into_par_iter().map(change).collect();
    let (mut light, mut low, mut high) = (1.0_f32, 1.0_f32, 1.0_f32);
    for change in changes {
        light *= change;
        (low, high) = (low.min(light), high.max(light));
    }
    high / low > 1.0 + LARGEST_CHANGE
}

#[cfg(test)]
mod tests {
    use super::*;
    use epirig_core::tau::Tau;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Texture that moves by 2 px a frame, in light that changes by this share over the sequence.
    fn changes_by(share: f32) -> bool {
        const FRAMES: usize = 21;
        let mut volume = Volume::fine(20, 300, 8, Tau::equidistant(FRAMES).unwrap());
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let texture: Vec<f32> = (0..400).map(|_| random.random_range(20.0..180.0)).collect();
        for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
            let (x, t) = (index % 300, index / 300 % FRAMES);
            let light = 1.0 + share * (t as f32 / (FRAMES - 1) as f32 - 0.5);
            *count = (128.0 * light * texture[x + 2 * t]) as u16;
        }
        changes_much(&volume)
    }

    #[test]
    fn light_that_drifts_far_is_told_from_texture_that_moves() {
        assert!(!changes_by(0.0) && !changes_by(0.1));
        assert!(changes_by(0.3) && changes_by(-0.5));
    }

    #[test]
    fn a_bright_object_that_crosses_dark_ground_is_no_light() {
        let mut volume = Volume::fine(20, 300, 8, Tau::equidistant(51).unwrap());
        for (index, count) in volume.fine_counts_mut().unwrap().iter_mut().enumerate() {
            let (x, t) = (index % 300, index / 300 % 51);
            let object = 3 * t..3 * t + 120;
            let intensity =
                if object.contains(&x) { 100.0 + 40.0 * (0.7 * (x - 3 * t) as f32).sin() } else { 10.0 };
            *count = (128.0 * intensity) as u16;
        }
        assert!(!changes_much(&volume));
    }

    #[test]
    fn frames_without_light_tell_nothing() {
        assert!(!changes_much(&Volume::fine(4, 40, 8, Tau::equidistant(5).unwrap())));
    }
}
