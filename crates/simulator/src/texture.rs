//! The simulated paint: band-limited random texture, fixed to the surface.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Granite-like texture: random reflectances on a lattice, joined by cubic B-splines.
///
/// A cubic B-spline of lattice step h passes less than 0.3 % of the frequencies beyond 1.5 / h cycles per mm
/// (its response is the fourth power of a sinc). So three samples per pixel do not alias as long as a grain
/// is at least a pixel wide.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Texture {
    /// Lattice step, in mm on the surface.
    pub grain_mm: f64,
    /// Share of the contrast in grains four times as wide, 0 to 1.
    pub coarse_share: f64,
    /// Seed of the random reflectances.
    pub seed: u64,
}

/// Lattice cells after which the texture repeats, a power of two.
const PERIOD: usize = 1024;
/// Ratio of the two grain sizes.
const COARSE: usize = 4;

/// The texture, ready to be looked up.
#[derive(Debug, Clone)]
pub(super) struct Paint {
    grain_mm: f64,
    /// B-spline coefficients, PERIOD x PERIOD, in [0, 1].
    lattice: Vec<f32>,
}

impl Paint {
    pub(super) fn new(texture: &Texture) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(texture.seed);
        let mut noise = |count: usize| -> Vec<f32> { (0..count).map(|_| random.random::<f32>()).collect() };
        let fine = noise(PERIOD * PERIOD);
        let coarse = noise((PERIOD / COARSE).pow(2));
        let share = texture.coarse_share as f32;
        let mut lattice = fine;
        for (index, value) in lattice.iter_mut().enumerate() {
            let position = |cell: usize| cell as f64 / COARSE as f64;
            let (x, y) = (position(index % PERIOD), position(index / PERIOD));
            *value = (1.0 - share) * *value + share * spline(&coarse, PERIOD / COARSE, x, y);
        }
        Self { grain_mm: texture.grain_mm, lattice }
    }

    /// Reflectance at a point of the surface, in [0, 1].
    pub(super) fn reflectance(&self, across_mm: f64, along_mm: f64) -> f32 {
        spline(&self.lattice, PERIOD, across_mm / self.grain_mm, along_mm / self.grain_mm)
    }
}

/// Two-dimensional cubic B-spline over a periodic lattice of `period` x `period` coefficients, `period` a
/// power of two.
fn spline(lattice: &[f32], period: usize, x: f64, y: f64) -> f32 {
    let (whole_x, whole_y) = (floor(x), floor(y));
    let weights_x = weights((x - whole_x as f64) as f32);
    let weights_y = weights((y - whole_y as f64) as f32);
    let mask = period - 1;
    let place = |whole: i64, offset: usize| (whole - 1 + offset as i64) as usize & mask;
    let columns = [0, 1, 2, 3].map(|offset| place(whole_x, offset));
    let mut sum = 0.0;
    for (offset, weight) in weights_y.iter().enumerate() {
        let row = &lattice[place(whole_y, offset) * period..][..period];
        let along: f32 = columns.iter().zip(&weights_x).map(|(&column, weight)| weight * row[column]).sum();
        sum += weight * along;
    }
    sum
}

/// The greatest whole number that is not greater. `f64::floor` is a call of a function for processors in general.
fn floor(x: f64) -> i64 {
    let toward_zero = x as i64;
    toward_zero - i64::from(toward_zero as f64 > x)
}

fn weights(f: f32) -> [f32; 4] {
    let g = 1.0 - f;
    [
        g * g * g / 6.0,
        (4.0 + f * f * (3.0 * f - 6.0)) / 6.0,
        (4.0 + g * g * (3.0 * g - 6.0)) / 6.0,
        f * f * f / 6.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_texture_is_seeded_smooth_and_has_contrast() {
        let texture = Texture { grain_mm: 0.5, coarse_share: 0.35, seed: 7 };
        let (paint, same) = (Paint::new(&texture), Paint::new(&texture));
        let other = Paint::new(&Texture { seed: 8, ..texture });
        let mut values = Vec::new();
        for step in 0..2000 {
            let (u, v) = (-90.0 + f64::from(step) * 0.09, 11.0 - f64::from(step) * 0.013);
            let value = paint.reflectance(u, v);
            assert_eq!(value, same.reflectance(u, v));
            // A B-spline changes by at most twice its coefficients' range per lattice step.
            assert!((paint.reflectance(u + 0.005, v) - value).abs() < 0.02 + 1e-6);
            assert!((0.0..=1.0).contains(&value));
            values.push(f64::from(value));
        }
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64;
        assert!((0.4..0.6).contains(&mean) && variance.sqrt() > 0.05, "{mean} {variance}");
        assert!(
            (0..50).any(|u| other.reflectance(f64::from(u), 0.0) != paint.reflectance(f64::from(u), 0.0))
        );
    }
}
