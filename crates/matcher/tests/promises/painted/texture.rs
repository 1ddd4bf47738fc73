//! Textures as sums of waves, of which every blur and every gradient is known in closed form.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::aperture::Aperture;

/// amplitude cos(2 pi (across x + along y) + phase), on the surface as the middle of the baseline sees it.
#[derive(Clone, Copy)]
pub struct Wave {
    /// Cycles per px along x.
    pub across: f64,
    /// Cycles per px along y.
    pub along: f64,
    /// Amplitude in DN of 8 bit.
    pub amplitude_dn: f64,
    /// Phase at the image's first pixel, in rad.
    pub phase: f64,
}

/// A sum of waves around grey.
#[derive(Clone)]
pub struct Texture {
    /// The waves; the first is the grey itself.
    pub waves: Vec<Wave>,
}

impl Texture {
    /// Middle grey, 128 DN.
    pub fn grey() -> Self {
        Self { waves: vec![Wave { across: 0.0, along: 0.0, amplitude_dn: 128.0, phase: 0.0 }] }
    }

    /// Waves of 1 DN in random directions, as many for each square of the frequency plane: white noise
    /// without wavelengths below `shortest_px` or above `longest_px`.
    pub fn white(seed: u64, waves: usize, (shortest_px, longest_px): (f64, f64)) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut texture = Self::grey();
        let (low, high) = (longest_px.powi(-2), shortest_px.powi(-2));
        for index in 0..waves {
            // One wave from each of as many rings of equal area, so that no part of the spectrum is missing
            // by chance.
            let ring = (index as f64 + random.random::<f64>()) / waves as f64;
            let frequency = (low + (high - low) * ring).sqrt();
            let (sin, cos) = (TAU * random.random::<f64>()).sin_cos();
            texture.waves.push(Wave {
                across: frequency * cos,
                along: frequency * sin,
                amplitude_dn: 1.0,
                phase: TAU * random.random::<f64>(),
            });
        }
        texture
    }

    /// The texture with one wave along x more.
    pub fn with_stripes(mut self, period_px: f64, amplitude_dn: f64) -> Self {
        self.waves.push(Wave { across: 1.0 / period_px, along: 0.0, amplitude_dn, phase: 1.0 });
        self
    }

    /// Scales the waves so that a picture through `aperture` has this contrast, root mean square.
    pub fn with_contrast(self, aperture: Aperture, rms_dn: f64) -> Self {
        let contrast = self.power(aperture, |_| 1.0).sqrt();
        self.scaled(rms_dn / contrast)
    }

    /// Scales the waves so that a picture through `aperture` has this gradient along x, root mean square.
    pub fn with_gradient(self, aperture: Aperture, rms_dn_per_px: f64) -> Self {
        let gradient = self.power(aperture, |wave| (TAU * wave.across).powi(2)).sqrt();
        self.scaled(rms_dn_per_px / gradient)
    }

    /// Half the sum of the squared amplitudes that `aperture` leaves, each times `factor`.
    fn power(&self, aperture: Aperture, factor: impl Fn(&Wave) -> f64) -> f64 {
        let seen =
            |wave: &Wave| wave.amplitude_dn * aperture.response(wave.across) * aperture.response(wave.along);
        self.waves[1..].iter().map(|wave| 0.5 * seen(wave).powi(2) * factor(wave)).sum()
    }

    fn scaled(mut self, factor: f64) -> Self {
        self.waves[1..].iter_mut().for_each(|wave| wave.amplitude_dn *= factor);
        self
    }
}
