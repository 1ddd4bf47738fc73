//! The simulated sensor: noise, quantisation, and pixels that are not alike.

use std::collections::BTreeSet;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::error::{SimulatorError, require, require_positive};
use epirig_core::frame::{Frame, Samples, full_scale};
use epirig_core::grid::Grid;

/// Level of a white surface on the axis, as a share of full scale: bright, not saturated.
const WHITE: f32 = 0.9;
/// Level of a hot pixel, as a share of full scale: near it, but not saturated.
const HOT: f32 = 0.97;
/// Keeps the pattern of pixels apart from the noise, which has the same seed.
const PATTERN: u64 = 0x7069_7865_6c73;

/// A linear sensor with read noise and shot noise (both Gaussian; a good model of shot noise above some 20
/// electrons).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// Bits of a sample: 8, 10, 12 or 16.
    pub bit_depth: u8,
    /// Electrons at full scale; their statistics make the shot noise. `None` for no shot noise.
    pub full_well_electrons: Option<f64>,
    /// Standard deviation of the read noise, in DN.
    pub read_noise_dn: f64,
    /// Seed of the noise, and of the differences between pixels.
    pub seed: u64,
    /// Level without light, in DN.
    #[serde(default)]
    pub black_level_dn: f64,
    /// Standard deviation of the pixels' gains, the same in all frames; a share of 1.
    #[serde(default)]
    pub pixel_gain_sigma: f64,
    /// Number of pixels, at places that the seed chooses, that read 97 % of full scale whatever the light.
    #[serde(default)]
    pub hot_pixels: usize,
}

impl Sensor {
    /// No noise but quantisation.
    pub fn ideal(bit_depth: u8) -> Self {
        Self {
            bit_depth,
            full_well_electrons: None,
            read_noise_dn: 0.0,
            seed: 1,
            black_level_dn: 0.0,
            pixel_gain_sigma: 0.0,
            hot_pixels: 0,
        }
    }

    /// Checks the numbers of a sensor of `pixels` pixels.
    pub(super) fn check(&self, pixels: usize) -> Result<(), SimulatorError> {
        let Self { bit_depth, read_noise_dn, black_level_dn, pixel_gain_sigma, hot_pixels, .. } = *self;
        require([8, 10, 12, 16].contains(&bit_depth), "bit depth", bit_depth.into(), "8, 10, 12 or 16")?;
        let is_noise = read_noise_dn.is_finite() && read_noise_dn >= 0.0;
        require(is_noise, "read noise in DN", read_noise_dn, "zero or positive")?;
        let is_black = (0.0..=0.5 * f64::from(full_scale(bit_depth))).contains(&black_level_dn);
        require(is_black, "black level in DN", black_level_dn, "from 0 to half of full scale")?;
        let is_alike = (0.0..=0.1).contains(&pixel_gain_sigma);
        require(is_alike, "deviation of the pixels' gains", pixel_gain_sigma, "from 0 to 0.1")?;
        let are_few = hot_pixels <= pixels / 100;
        require(are_few, "number of hot pixels", hot_pixels as f64, "at most one pixel in a hundred")?;
        let full_well = self.full_well_electrons;
        full_well.map_or(Ok(()), |electrons| require_positive("full well in electrons", electrons))
    }

    /// Numbers for `irradiance` (shares of full scale at reflectance 1) under a lamp that gives `lamp` of its
    /// mean light; `exposure` chooses the noise.
    pub(super) fn digitise(&self, irradiance: &Grid<f32>, lamp: f32, exposure: u32) -> Frame {
        let scale = f32::from(full_scale(self.bit_depth));
        let black = self.black_level_dn as f32;
        let (rows, columns) = (irradiance.rows(), irradiance.columns());
        let mut levels = vec![0_u16; rows * columns];
        levels.par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
            let mut noise = self.noise(exposure, y);
            let mut gain = self.gains(y);
            for (level, &light) in out.iter_mut().zip(irradiance.row(y)) {
                let signal = light * WHITE * scale * lamp * gain();
                // A conversion drops the fraction and clips negative values; `round` is a call for each
                // pixel.
                *level = (f64::from((black + signal + noise(signal)).min(scale)) + 0.5) as u16;
            }
        });
        for place in self.hot_places(levels.len()) {
            levels[place] = (HOT * scale).round() as u16;
        }
        let samples = if self.bit_depth <= 8 {
            Samples::U8(levels.into_iter().map(|level| level as u8).collect())
        } else {
            Samples::U16(levels)
        };
        Frame::new(rows, columns, self.bit_depth, samples).expect("levels are clamped to the bit depth")
    }

    /// The gains of the pixels of row `y`, one after the other.
    fn gains(&self, y: usize) -> impl FnMut() -> f32 {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ PATTERN);
        random.set_stream(1 + y as u64);
        let sigma = self.pixel_gain_sigma;
        move || {
            if sigma == 0.0 {
                return 1.0;
            }
            let unit: f64 = StandardNormal.sample(&mut random);
            (1.0 + sigma * unit) as f32
        }
    }

    /// Where hot pixels are, of `pixels`; each place once.
    fn hot_places(&self, pixels: usize) -> BTreeSet<usize> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ PATTERN);
        let mut places = BTreeSet::new();
        while places.len() < self.hot_pixels.min(pixels) {
            places.insert(random.random_range(0..pixels));
        }
        places
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
        let frame = sensor.digitise(&Grid::filled(200, 200, light), 1.0, 3);
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
        let light = Grid::filled(8, 8, 0.5);
        assert_eq!(sensor.digitise(&light, 1.0, 1), sensor.digitise(&light, 1.0, 1));
        assert_ne!(sensor.digitise(&light, 1.0, 1), sensor.digitise(&light, 1.0, 2));
    }

    fn levels(sensor: &Sensor, light: f32, exposure: u32) -> Vec<f64> {
        let frame = sensor.digitise(&Grid::filled(200, 200, light), 1.0, exposure);
        let mut values = vec![0.0; 40_000];
        frame.samples().copy_to_f32(0, &mut values);
        values.into_iter().map(f64::from).collect()
    }

    #[test]
    fn black_level_lamp_and_gains_act_as_stated() {
        let sensor = Sensor { black_level_dn: 12.0, ..Sensor::ideal(8) };
        assert!(levels(&sensor, 0.0, 1).iter().all(|&level| level == 12.0));
        // 12 + 0.5 * 0.9 * 255 = 126.75, and with 4 % more light 131.34.
        assert!(levels(&sensor, 0.5, 1).iter().all(|&level| level == 127.0));
        let brighter = sensor.digitise(&Grid::filled(8, 8, 0.5), 1.04, 1);
        assert_eq!(brighter.samples().mean(), 131.0);

        let uneven = Sensor { pixel_gain_sigma: 0.02, ..Sensor::ideal(12) };
        let (once, again) = (levels(&uneven, 0.5, 1), levels(&uneven, 0.5, 2));
        assert_eq!(once, again);
        let mean = once.iter().sum::<f64>() / 4e4;
        let variance = once.iter().map(|level| (level - mean).powi(2)).sum::<f64>() / 4e4;
        // 2 % of 0.45 * 4095 and the 1/12 of quantisation, to 4 x sqrt(2 / 40000).
        let expected = (0.02_f64 * 0.45 * 4095.0).powi(2) + 1.0 / 12.0;
        assert!((variance / expected - 1.0).abs() < 0.028, "{variance} {expected}");
        assert!(levels(&uneven, 0.0, 1).iter().all(|&level| level == 0.0));
    }

    #[test]
    fn hot_pixels_stay_where_they_are() {
        let sensor = Sensor { hot_pixels: 25, ..Sensor::ideal(8) };
        // 0.97 * 255 = 247.35.
        let places = |light, exposure| -> Vec<usize> {
            let levels = levels(&sensor, light, exposure);
            (0..40_000).filter(|&place| levels[place] == 247.0).collect()
        };
        assert_eq!(places(0.0, 1).len(), 25);
        assert_eq!(places(0.0, 1), places(0.5, 2));
        assert!(Sensor { hot_pixels: 101, ..sensor.clone() }.check(10_000).is_err());
        assert_eq!(sensor.check(10_000), Ok(()));
    }
}
