//! The light of the simulated lamp, exposure by exposure.

use epirig_core::grid::Grid;
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

/// Radius of a highlight (standard deviation), as a share of the image's width.
const HIGHLIGHT_RADIUS: f64 = 0.15;

/// Multiplies the light on the sensor by `gain`, and adds a `highlight` that is as bright as this
/// in the middle of the image.
pub(super) fn change(light: &mut Grid<f32>, gain: f64, highlight: f64) {
    if gain == 1.0 && highlight == 0.0 {
        return;
    }
    let (rows, columns) = (light.rows(), light.columns());
    let place = |index: usize, count: usize| (index as f64 - 0.5 * (count - 1) as f64) / columns as f64;
    let falls = |place: f64| (-0.5 * (place / HIGHLIGHT_RADIUS).powi(2)).exp();
    let across: Vec<f64> = (0..columns).map(|x| falls(place(x, columns))).collect();
    for y in 0..rows {
        let more = highlight * falls(place(y, rows));
        for (value, across) in light.row_mut(y).iter_mut().zip(&across) {
            *value = (gain * f64::from(*value) + more * across) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_highlight_is_brightest_in_the_middle_and_stands_beside_the_gain() {
        let mut light = Grid::filled(11, 21, 0.25);
        change(&mut light, 1.1, 0.05);
        // 0.25 * 1.1 and the highlight, which has fallen to exp(-1/2) within 0.15 of 21 columns:
        // 3.15.
        assert!((light.at(10, 5) - 0.325).abs() < 1e-6);
        let beside = 0.275 + 0.05 * (-0.5 * (3.0_f32 / 3.15).powi(2)).exp();
        assert!((light.at(13, 5) - beside).abs() < 1e-6);
        let unchanged = Grid::filled(3, 4, 0.25);
        let mut same = unchanged.clone();
        change(&mut same, 1.0, 0.0);
        assert_eq!(same, unchanged);
    }

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
