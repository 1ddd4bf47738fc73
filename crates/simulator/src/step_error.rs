//! The true position of the simulated carriage.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

const UM_PER_MM: f64 = 1000.0;

/// The error of each position that the stage reports: Gaussian, and the same whenever it comes there, as a
/// lead screw repeats its errors. Positions that differ by a micrometre have nothing to do with each other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StepError {
    /// Standard deviation, in um; 0 for none.
    pub sigma_um: f64,
    /// Chooses the errors.
    pub seed: u64,
}

impl StepError {
    /// The true position where `position_mm` is reported, in mm from home.
    pub(super) fn true_position_mm(&self, position_mm: f64) -> f64 {
        if self.sigma_um == 0.0 {
            return position_mm;
        }
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream((position_mm * UM_PER_MM).round() as i64 as u64);
        let unit: f64 = StandardNormal.sample(&mut random);
        position_mm + self.sigma_um / UM_PER_MM * unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_repeat_and_have_the_stated_deviation() {
        let error = StepError { sigma_um: 5.0, seed: 3 };
        let errors_um: Vec<f64> = (0..10_000)
            .map(|step| {
                let position_mm = 0.015 * f64::from(step);
                assert_eq!(error.true_position_mm(position_mm), error.true_position_mm(position_mm));
                (error.true_position_mm(position_mm) - position_mm) * 1000.0
            })
            .collect();
        let mean = errors_um.iter().sum::<f64>() / 1e4;
        let variance = errors_um.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / 1e4;
        // Four standard deviations of a mean and of a variance of 10000 values.
        assert!(mean.abs() < 4.0 * 5.0 / 100.0, "{mean}");
        assert!((variance / 25.0 - 1.0).abs() < 4.0 * 2.0_f64.sqrt() / 100.0, "{variance}");
        let other = StepError { seed: 4, ..error };
        assert_ne!(other.true_position_mm(1.5), error.true_position_mm(1.5));
        assert_eq!(StepError::default().true_position_mm(1.234), 1.234);
    }
}
