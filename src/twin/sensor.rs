//! The twin's sensor: noise and quantisation.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::TwinError;
use crate::frame::{Frame, Samples, full_scale};
use crate::plane::Plane;

/// Level of a white surface on the axis, as a share of full scale: bright, not saturated.
const WHITE: f32 = 0.9;

/// A linear sensor with read noise and shot noise (both Gaussian; a good model of shot noise above some 20 electrons).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Bits of a sample: 8, 10, 12 or 16.
    pub bit_depth: u8,
    /// Electrons at full scale; their statistics make the shot noise. `None` for no shot noise.
    pub full_well_electrons: Option<f64>,
    /// Standard deviation of the read noise, in DN.
    pub read_noise_dn: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Sensor {
    /// No noise but quantisation.
    pub fn ideal(bit_depth: u8) -> Self {
        Self { bit_depth, full_well_electrons: None, read_noise_dn: 0.0, seed: 1 }
    }

    pub(super) fn check(&self) -> Result<(), TwinError> {
        let bad = |what, value, expected| Err(TwinError::BadNumber { what, value, expected });
        if ![8, 10, 12, 16].contains(&self.bit_depth) {
            return bad("bit depth", self.bit_depth.into(), "8, 10, 12 or 16");
        }
        if !(self.read_noise_dn.is_finite() && self.read_noise_dn >= 0.0) {
            return bad("read noise in DN", self.read_noise_dn, "zero or positive");
        }
        match self.full_well_electrons {
            Some(value) if !(value.is_finite() && value > 0.0) => {
                bad("full well in electrons", value, "positive")
            }
            _ => Ok(()),
        }
    }

    /// Numbers for `irradiance` (shares of full scale at reflectance 1); `exposure` chooses the noise.
    pub(super) fn digitise(&self, irradiance: &Plane<f32>, exposure: u32) -> Frame {
        let scale = f32::from(full_scale(self.bit_depth));
        let (rows, columns) = (irradiance.rows(), irradiance.columns());
        let mut levels = vec![0_u16; rows * columns];
        levels.par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
            let mut noise = self.noise(exposure, y);
            for (level, &light) in out.iter_mut().zip(irradiance.row(y)) {
                let signal = light * WHITE * scale;
                *level = (signal + noise(signal)).round().clamp(0.0, scale) as u16;
            }
        });
        let samples = if self.bit_depth <= 8 {
            Samples::U8(levels.into_iter().map(|level| level as u8).collect())
        } else {
            Samples::U16(levels)
        };
        Frame::new(rows, columns, self.bit_depth, samples).expect("levels are clamped to the bit depth")
    }

    /// A source of noise in DN for row `y` of one exposure, given the signal in DN.
    fn noise(&self, exposure: u32, y: usize) -> impl FnMut(f32) -> f32 {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(u64::from(exposure) << 32 | y as u64);
        let read_variance = self.read_noise_dn * self.read_noise_dn;
        let dn_per_electron = self
            .full_well_electrons
            .map_or(0.0, |electrons| f64::from(full_scale(self.bit_depth)) / electrons);
        let silent = read_variance == 0.0 && dn_per_electron == 0.0;
        move |signal| {
            if silent {
                return 0.0;
            }
            let deviation = (read_variance + dn_per_electron * f64::from(signal)).sqrt();
            let unit: f64 = StandardNormal.sample(&mut random);
            (deviation * unit) as f32
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statistics(sensor: &Sensor, light: f32) -> (f64, f64) {
        let frame = sensor.digitise(&Plane::filled(200, 200, light), 3);
        let mut values = vec![0.0; 40_000];
        frame.samples().copy_to_f32(0, &mut values);
        let mean = values.iter().map(|&value| f64::from(value)).sum::<f64>() / 40_000.0;
        let variance = values.iter().map(|&value| (f64::from(value) - mean).powi(2)).sum::<f64>() / 39_999.0;
        (mean, variance)
    }

    #[test]
    fn noise_has_the_stated_variance_and_grows_with_light() {
        let read = Sensor { read_noise_dn: 3.0, ..Sensor::ideal(10) };
        let (mean, variance) = statistics(&read, 0.5);
        // Mean 0.5 * 0.9 * 1023; variance 9 plus 1/12 of quantisation, known to 4 x sqrt(2 / 40000) = 2.8 %.
        assert!((mean - 460.35).abs() < 0.07, "{mean}");
        assert!((variance / (9.0 + 1.0 / 12.0) - 1.0).abs() < 0.028, "{variance}");
        let shot = Sensor { full_well_electrons: Some(10_000.0), ..Sensor::ideal(12) };
        let (mean, variance) = statistics(&shot, 0.8);
        let expected = mean * 4095.0 / 10_000.0 + 1.0 / 12.0;
        assert!((variance / expected - 1.0).abs() < 0.028, "{variance} {expected}");
    }

    #[test]
    fn the_same_exposure_repeats_and_another_differs() {
        let sensor = Sensor { read_noise_dn: 2.0, ..Sensor::ideal(8) };
        let light = Plane::filled(8, 8, 0.5);
        assert_eq!(sensor.digitise(&light, 1), sensor.digitise(&light, 1));
        assert_ne!(sensor.digitise(&light, 1), sensor.digitise(&light, 2));
    }
}
