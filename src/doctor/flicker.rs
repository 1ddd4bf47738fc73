//! Flicker of lamps: its size in frames of one view, and exposures that avoid it.
//!
//! A lamp on mains brightens twice per period. An exposure of a whole number of half periods collects the
//! same light whenever it begins. Other exposures give frames of different brightness. If the sensor exposes
//! its rows one after the other (rolling shutter), the rows differ too: bands.

use super::view::View;

/// Tolerance for exposures of whole half periods, relative to a half period.
const TOLERANCE: f64 = 0.02;
const US_PER_S: f64 = 1e6;

/// Variation of the light in frames of one view, as standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flicker {
    /// Of whole frames, relative to the mean intensity, with noise subtracted.
    pub(super) common_share: f64,
    /// Of rows within their frame, relative to the mean intensity, with noise subtracted.
    pub(super) band_share: f64,
    /// Of rows within their frame as expected from pixel noise alone, relative to the mean intensity.
    pub(super) noise_share: f64,
    /// Mean intensity, in DN.
    pub(super) mean_dn: f64,
}

impl Flicker {
    /// Flicker in the frames of a view. All shares are 0 without light, or for a single frame.
    pub(super) fn of(view: &View) -> Self {
        let rows = view.row_means_dn();
        let (frames, height) = (rows.len() as f64, rows.first().map_or(0, Vec::len) as f64);
        let means: Vec<f64> = (0..height as usize)
            .map(|y| rows.iter().map(|row_means| row_means[y]).sum::<f64>() / frames)
            .collect();
        let mean_dn = means.iter().sum::<f64>() / height;
        if !(frames > 1.0 && mean_dn > 0.0) {
            return Self { common_share: 0.0, band_share: 0.0, noise_share: 0.0, mean_dn: 0.0 };
        }
        let (mut common, mut bands) = (0.0, 0.0);
        for row_means in rows {
            let light = row_means.iter().sum::<f64>() / (mean_dn * height);
            common += (light - 1.0).powi(2);
            let off =
                row_means.iter().zip(&means).map(|(row_dn, mean_dn)| (row_dn - light * mean_dn).powi(2));
            bands += off.sum::<f64>();
        }
        // The mean over the frames takes one degree of freedom, the brightness of the frame one row.
        let common = common / (frames - 1.0);
        let bands = bands / ((frames - 1.0) * (height - 1.0).max(1.0) * mean_dn * mean_dn);
        let of_row = (view.noise_dn() / mean_dn).powi(2) / view.columns() as f64;
        Self {
            common_share: (common - of_row / height).max(0.0).sqrt(),
            band_share: (bands - of_row).max(0.0).sqrt(),
            noise_share: of_row.sqrt(),
            mean_dn,
        }
    }

    /// Standard deviation of a pixel's intensity by flicker, in DN.
    pub(super) fn intensity_dn(&self) -> f64 {
        self.common_share.hypot(self.band_share) * self.mean_dn
    }
}

/// Whether an exposure of `exposure_us` is a multiple of half a period of mains of `mains_hz`, to 2 % of
/// that.
pub(super) fn suits_mains(exposure_us: f64, mains_hz: f64) -> bool {
    let half_periods = exposure_us * 2.0 * mains_hz / US_PER_S;
    half_periods.round() >= 1.0 && (half_periods - half_periods.round()).abs() <= TOLERANCE
}

/// The exposure nearest to `exposure_us` that suits mains of `mains_hz`, in us.
pub(super) fn nearest_exposure_us(exposure_us: f64, mains_hz: f64) -> f64 {
    let half_period_us = US_PER_S / (2.0 * mains_hz);
    (exposure_us / half_period_us).round().max(1.0) * half_period_us
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use epirig_core::frame::{Frame, Samples};

    /// 24 frames of 100 DN, 12 bit, in which frame and row are brighter by a share.
    fn view(noise_dn: f64, light: impl Fn(f64, f64) -> f64) -> View {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut frames = (0..24).map(|t| {
            let samples = (0..60 * 80).map(|index| {
                let unit: f64 = random.sample(StandardNormal);
                let y = f64::from(index / 80);
                (1000.0 * (1.0 + light(f64::from(t), y)) + noise_dn * unit).round() as u16
            });
            Frame::new(60, 80, 12, Samples::U16(samples.collect())).unwrap()
        });
        let mut view = View::new(&frames.next().unwrap());
        frames.for_each(|frame| assert!(view.add(&frame)));
        view
    }

    #[test]
    fn steady_light_does_not_flicker() {
        let found = Flicker::of(&view(10.0, |_, _| 0.0));
        // Rows of 80 pixels: 1 % / sqrt 80. 24 x 60 of them tell variances to 3.7 %, so their excess to 0.19
        // of the deviation.
        assert!((found.noise_share - 0.01 / 80_f64.sqrt()).abs() < 0.03 * found.noise_share, "{found:?}");
        assert!(found.band_share < 2.0 * 0.19 * found.noise_share, "{found:?}");
        // One frame's mean is known to 1 % / sqrt 4800.
        assert!(found.common_share < 2.0 * 0.01 / 4800_f64.sqrt(), "{found:?}");
    }

    #[test]
    fn bands_and_whole_frames_are_told_apart() {
        // A wave of 2 % amplitude has a deviation of 2 % / sqrt 2; these run through whole periods.
        let expected = 0.02 / 2_f64.sqrt();
        let wave = |cycles: f64| 0.02 * (std::f64::consts::TAU * cycles).sin();
        let bands = Flicker::of(&view(5.0, |t, y| wave(y / 20.0 + t / 24.0)));
        assert!((bands.band_share / expected - 1.0).abs() < 0.04 && bands.common_share < 1e-3, "{bands:?}");
        let whole = Flicker::of(&view(5.0, |t, _| wave(t / 24.0)));
        assert!((whole.common_share / expected - 1.0).abs() < 0.04 && whole.band_share < 1e-3, "{whole:?}");
        assert!((whole.intensity_dn() - 1000.0 * expected).abs() < 1.0, "{whole:?}");
    }

    #[test]
    fn whole_half_periods_suit() {
        assert!(suits_mains(10_000.0, 50.0) && suits_mains(40_100.0, 50.0) && suits_mains(8_333.0, 60.0));
        assert!(!suits_mains(10_000.0, 60.0) && !suits_mains(8_333.0, 50.0) && !suits_mains(5.0, 50.0));
        assert_eq!(nearest_exposure_us(12_000.0, 50.0), 10_000.0);
        assert_eq!(nearest_exposure_us(100.0, 50.0), 10_000.0);
        assert!((nearest_exposure_us(23_000.0, 60.0) - 25_000.0).abs() < 1e-6);
    }
}
