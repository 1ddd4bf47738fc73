//! Pixel locking over many frames: its cause, and how far a disparity is exposed to it.
//!
//! Frame t is sampled at x + d tau'_t, at the fraction f_t of a pixel. The error of interpolation is periodic
//! in f_t: as a displacement it is a sum of harmonics sin(2 pi h f_t). Over frames whose fractions are spread
//! evenly it cancels. Near d = (N - 1) p / q, for N equidistant frames, harmonic q drifts slowly instead, and
//! the fit takes the drift for disparity. The error is the same for all pixels of that disparity, so no
//! average over pixels shows it.

use serde::{Deserialize, Serialize};

/// Number of harmonics of the fraction of a pixel that are measured. The q-th needs texture of at least q -
/// 1/2 periods per px, which hardly passes a pixel.
pub(crate) const LOCKING_HARMONICS: usize = 2;

/// Displacement of points by one harmonic of the fraction of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct LockingHarmonic {
    /// Amplitude, in px, of the error of interpolation, which attenuates texture near two pixels per period;
    /// at any disparity.
    pub interpolation_px: f64,
    /// Its standard deviation, in px.
    pub interpolation_sigma_px: f64,
    /// Amplitude, in px, of the error of aliasing, at disparities where fractions repeat only: the sensor
    /// shows texture finer than two pixels per period as a coarser one that moves differently.
    pub aliasing_px: f64,
    /// Its standard deviation, in px.
    pub aliasing_sigma_px: f64,
}

/// The amplitudes of pixel locking, as measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct LockingAmplitudes {
    /// The harmonics, the first first.
    pub harmonics: [LockingHarmonic; LOCKING_HARMONICS],
    /// Whether the amplitudes come from lines with well spread fractions. Then biases are predicted within
    /// about a third for texture behind a blur of 0.7 px, and overstated by up to a factor of two for sharper
    /// texture. Otherwise only the first amplitude of interpolation is known, from the texture of single
    /// frames, and that of aliasing is not: biases are overstated two- to threefold behind such a blur, and
    /// only their order of magnitude is right without one.
    pub from_lines: bool,
}

/// The effect of pixel locking on the disparities of a match.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PixelLocking {
    /// The measured amplitudes.
    pub amplitudes: LockingAmplitudes,
    /// The largest predicted bias of an answered pixel, in px, signed as the error of its disparity; 0 if
    /// none is significant.
    pub worst_bias_px: f64,
    /// The disparity that has it, in px; `None` without such a bias.
    pub worst_disparity_px: Option<f64>,
    /// Share of the answered pixels, 0 to 1, whose predicted bias exceeds a tenth of the wanted sigma, or of
    /// their own where none is given.
    pub share_locked: f64,
    /// Smallest and largest disparity of those pixels, in px.
    pub locked_px: Option<(f64, f64)>,
}

/// A bias counts from here on, in px: a twentieth of the accuracy that is wanted of single pixels.
const NOTICEABLE_PX: f64 = 0.0005;

impl PixelLocking {
    /// Summary over answered pixels, given as disparity and predicted bias in px.
    pub(super) fn of(amplitudes: LockingAmplitudes, pixels: impl Iterator<Item = [f32; 2]>) -> Self {
        let mut sum = Self {
            amplitudes,
            worst_bias_px: 0.0,
            worst_disparity_px: None,
            share_locked: 0.0,
            locked_px: None,
        };
        let (mut count, mut locked) = (0_usize, 0_usize);
        for pixel in pixels {
            let [disparity, bias] = pixel.map(f64::from);
            count += 1;
            if bias.abs() > sum.worst_bias_px.abs() {
                sum.worst_bias_px = bias;
                sum.worst_disparity_px = Some(disparity);
            }
            if bias.abs() > NOTICEABLE_PX {
                locked += 1;
                let (low, high) = sum.locked_px.unwrap_or((disparity, disparity));
                sum.locked_px = Some((low.min(disparity), high.max(disparity)));
            }
        }
        sum.share_locked = locked as f64 / count.max(1) as f64;
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_counted_by_their_bias() {
        let none = LockingHarmonic {
            interpolation_px: 0.0,
            interpolation_sigma_px: 0.0,
            aliasing_px: 0.0,
            aliasing_sigma_px: 0.0,
        };
        let amplitudes = LockingAmplitudes { harmonics: [none; LOCKING_HARMONICS], from_lines: true };
        let pixels = [[3.0, 0.0], [7.0, -0.0015], [5.0, 0.0011], [9.0, 0.0004]];
        let found = PixelLocking::of(amplitudes, pixels.into_iter());
        assert_eq!((found.share_locked, found.locked_px), (0.5, Some((5.0, 7.0))));
        assert_eq!(found.worst_disparity_px, Some(7.0));
        assert!((found.worst_bias_px + 0.0015).abs() < 1e-9);
        let nothing = PixelLocking::of(amplitudes, pixels.into_iter().take(1));
        assert_eq!((nothing.worst_bias_px, nothing.worst_disparity_px, nothing.locked_px), (0.0, None, None));
    }
}
