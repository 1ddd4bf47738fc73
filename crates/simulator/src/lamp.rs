//! The light of the simulated lamp, exposure by exposure.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Keeps the lamp's random numbers apart from those of the sensor, which has the same seed.
const LAMP: u64 = 0x6c61_6d70;

/// Light of one exposure as a share of the mean, for a lamp that flickers with standard deviation `flicker`.
pub(super) fn gain(flicker: f64, seed: u64, exposure: u32) -> f32 {
    if flicker == 0.0 {
        return 1.0;
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ LAMP);
    random.set_stream(exposure.into());
    let unit: f64 = StandardNormal.sample(&mut random);
    (1.0 + flicker * unit) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flicker_has_the_stated_deviation() {
        let gains: Vec<f64> = (0..10_000).map(|exposure| f64::from(gain(0.003, 1, exposure))).collect();
        let mean = gains.iter().sum::<f64>() / 1e4;
        let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / 1e4;
        // Four standard deviations of a mean and of a variance of 10000 values.
        assert!((mean - 1.0).abs() < 4.0 * 0.003 / 100.0, "{mean}");
        assert!((variance / 9e-6 - 1.0).abs() < 4.0 * 2.0_f64.sqrt() / 100.0, "{variance}");
        assert_eq!(gain(0.0, 1, 7), 1.0);
    }
}
