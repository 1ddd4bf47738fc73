//! Quintic B-splines through EPIs, with their first two derivatives, for the fit.
//!
//! Within an EPI all pixels of a block are sampled at the same fraction of a pixel, so a sample is six
//! neighbours times constant weights. The weights are tabulated; the next derivative corrects for the rest of
//! the fraction, up to a thousandth of a pixel.

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, dispatch, f32x16};

use super::padded::LANES;
use epirig_core::spline::quintic::{self, basis};
pub(super) use epirig_core::spline::quintic::{TAPS, TAPS_BEFORE};
use epirig_core::volume::Volume;

/// Tabulated fractions of a pixel.
pub(super) const FRACTIONS: usize = 512;
/// Columns beyond both borders for which coefficients are held.
pub(super) const MARGIN: usize = 32;
/// Reach of the prefilter, whose poles are -0.431 and -0.043. The part beyond is less than 3.6e-5, 0.009 DN
/// of 255 at worst.
const PREFILTER_REACH: usize = 14;

/// Variance of the value of a quintic B-spline through white noise, over that of the noise, mean over the
/// positions between pixels.
pub(super) const VALUE_NOISE_GAIN: f64 = 0.918;
/// The same for noise that was resampled by such splines once before, along x and along y: rectified frames.
pub(super) const RESAMPLED_NOISE_GAIN: f64 = 0.793;
/// The same for its derivative, per px^2.
pub(super) const GRADIENT_NOISE_GAIN: f64 = 2.678;

/// Weights of the six neighbours for value, first and second derivative at a fraction of a pixel.
pub(super) type Weights = [[f32; TAPS]; 3];

/// Tables that all rows share: the weights by fraction, and the filter from samples to coefficients.
#[derive(Debug)]
pub(super) struct Spline {
    weights: Vec<Weights>,
    prefilter: [f32; PREFILTER_REACH + 1],
    level: Level,
}

impl Spline {
    pub(super) fn new() -> Self {
        let weights = (0..FRACTIONS)
            .map(|index| {
                let fraction = index as f64 / FRACTIONS as f64;
                std::array::from_fn(|order| {
                    std::array::from_fn(|tap| {
                        let offset = tap as f64 - TAPS_BEFORE as f64;
                        basis(offset - fraction, order) as f32
                    })
                })
            })
            .collect();
        Self {
            weights,
            prefilter: quintic::impulse_response().map(|value| value as f32),
            level: Level::new(),
        }
    }

    /// The weights at fraction `index` / [`FRACTIONS`].
    pub(super) fn weights(&self, index: usize) -> &Weights {
        &self.weights[index]
    }
}

/// The coefficients of one EPI: frames x (columns + 2 margins).
#[derive(Debug, Default)]
pub(super) struct SplineEpi {
    columns: usize,
    coefficients: Vec<f32>,
    padded: Vec<f32>,
}

impl SplineEpi {
    /// Takes in row `y` of `frames` of `volume`.
    pub(super) fn take(
        &mut self,
        spline: &Spline,
        volume: &Volume,
        gains: Option<&[f32]>,
        y: usize,
        frames: impl Iterator<Item = usize>,
    ) {
        let columns = volume.columns();
        self.columns = columns;
        self.coefficients.resize(volume.frames() * self.stride(), 0.0);
        let border = MARGIN + PREFILTER_REACH;
        self.padded.resize(columns + 2 * border, 0.0);
        for t in frames {
            let row = &mut self.padded[border..border + columns];
            volume.copy_row(y, t, row);
            if let Some(gains) = gains {
                row.iter_mut().for_each(|value| *value *= gains[t]);
            }
            // Turned about the border's pixel, so that value and gradient go on without a jump.
            let (first, last) = (self.padded[border], self.padded[border + columns - 1]);
            for offset in 1..=border {
                let inside = mirrored(offset, columns);
                self.padded[border - offset] = 2.0 * first - self.padded[border + inside];
                self.padded[border + columns - 1 + offset] =
                    2.0 * last - self.padded[border + columns - 1 - inside];
            }
            let stride = self.stride();
            let out = &mut self.coefficients[t * stride..(t + 1) * stride];
            dispatch!(spline.level, simd => filter_row(simd, &self.padded, &spline.prefilter, out));
        }
    }

    fn stride(&self) -> usize {
        self.columns + 2 * MARGIN
    }

    /// The coefficients of frame `t` from [`TAPS_BEFORE`] before column `x` on, to the end of the frame's
    /// margin.
    pub(super) fn taps(&self, t: usize, x: isize) -> &[f32] {
        let first = (x + (MARGIN - TAPS_BEFORE) as isize) as usize;
        &self.coefficients[t * self.stride() + first..(t + 1) * self.stride()]
    }
}

/// How far inside the image the mirror image of the `offset`th column beyond its border lies.
fn mirrored(offset: usize, columns: usize) -> usize {
    let period = 2 * (columns - 1);
    let place = offset % period;
    place.min(period - place)
}

#[inline(always)]
fn filter_row<S: Simd>(simd: S, padded: &[f32], prefilter: &[f32; PREFILTER_REACH + 1], out: &mut [f32]) {
    // The last ones are computed twice, so that a coefficient does not depend on its place in the row.
    let last = out.len() - CHUNK;
    for start in (0..last).step_by(CHUNK).chain([last]) {
        let area = &padded[start..start + CHUNK + 2 * PREFILTER_REACH];
        filter_chunk(simd, area, prefilter, &mut out[start..start + CHUNK]);
    }
}

/// Outputs that stay in registers over all taps; both margins of a row hold as many.
const CHUNK: usize = 2 * MARGIN;

#[inline(always)]
fn filter_chunk<S: Simd>(simd: S, area: &[f32], prefilter: &[f32; PREFILTER_REACH + 1], out: &mut [f32]) {
    let load = |start: usize| f32x16::from_slice(simd, &area[start..start + LANES]);
    let mut sums = [f32x16::splat(simd, 0.0); CHUNK / LANES];
    for (sum, start) in sums.iter_mut().zip((PREFILTER_REACH..).step_by(LANES)) {
        *sum = load(start) * prefilter[0];
    }
    for (reach, &tap) in prefilter.iter().enumerate().skip(1) {
        for (sum, start) in sums.iter_mut().zip((PREFILTER_REACH..).step_by(LANES)) {
            let both = load(start - reach) + load(start + reach);
            *sum = both.mul_add(tap, *sum);
        }
    }
    for (out, sum) in out.chunks_exact_mut(LANES).zip(sums) {
        sum.store_slice(out);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU as TURN;

    use super::*;
    use epirig_core::tau::Tau;

    /// What the prefilter's end leaves out of samples up to 1: twice the sum of |h(n)| over n > 14, where
    /// h(15) = -1.003e-5 and each h(n + 1) = -0.4306 h(n).
    const CUT: f64 = 3.6e-5;
    /// Rounding: 15 sums of single precision (6e-8) of coefficients up to 7.5, the prefilter's largest gain.
    const ROUNDING: f64 = 1e-5;

    /// Value or derivative at `x` + `index` / FRACTIONS.
    fn sample(spline: &Spline, epi: &SplineEpi, x: isize, index: usize, order: usize) -> f64 {
        let weights = &spline.weights(index)[order];
        weights.iter().zip(epi.taps(0, x)).map(|(weight, tap)| f64::from(weight * tap)).sum()
    }

    /// The coefficients of samples that `signal` gives for columns inside and beyond the borders.
    fn spline_through(spline: &Spline, columns: usize, signal: impl Fn(f64) -> f64) -> SplineEpi {
        let border = MARGIN + PREFILTER_REACH;
        let column = |index: usize| index as f64 - border as f64;
        let padded: Vec<f32> = (0..columns + 2 * border).map(|index| signal(column(index)) as f32).collect();
        let mut epi = SplineEpi { columns, coefficients: vec![0.0; columns + 2 * MARGIN], padded };
        let out = &mut epi.coefficients;
        dispatch!(spline.level, simd => filter_row(simd, &epi.padded, &spline.prefilter, out));
        epi
    }

    /// A spline through one row of counts of 1/128 DN.
    fn spline_of_counts(spline: &Spline, counts: &[u16]) -> SplineEpi {
        let mut volume = Volume::fine(1, counts.len(), 8, Tau::equidistant(2).unwrap());
        volume.fine_counts_mut().unwrap()[..counts.len()].copy_from_slice(counts);
        let mut epi = SplineEpi::default();
        epi.take(spline, &volume, None, 0, 0..1);
        epi
    }

    #[test]
    fn pixels_are_reproduced() {
        let spline = Spline::new();
        // Anything without order up to 256 DN.
        let counts: Vec<u16> = (0..150_u64).map(|x| (x * x * x * 7919 % 32768) as u16).collect();
        let epi = spline_of_counts(&spline, &counts);
        for (x, count) in counts.iter().enumerate() {
            let error = sample(&spline, &epi, x as isize, 0, 0) - f64::from(*count) / 128.0;
            // Beyond the borders the turned samples reach 512 DN.
            assert!(error.abs() < 512.0 * (CUT + ROUNDING), "column {x}: {error}");
        }
    }

    /// The spline through exp(i omega x) is a sum of exp(i (omega + 2 pi k) x) with weights as (omega + 2 pi
    /// k)^-6 whose sum is 1 (Unser 1999, section on interpolation: the Fourier transform of the B-spline is
    /// sinc^6). So the derivative of an order errs by at most the sum over k != 0 of weight (|omega + 2 pi
    /// k|^order + omega^order).
    fn sixth_order_bound(omega: f64, order: i32) -> f64 {
        let weight = |k: i32| (omega + TURN * f64::from(k)).powi(-6);
        let all: f64 = (-50..=50).map(weight).sum();
        let others = (-50..=50).filter(|&k| k != 0);
        let error = |k: i32| (omega + TURN * f64::from(k)).abs().powi(order) + omega.powi(order);
        others.map(|k| weight(k) / all * error(k)).sum()
    }

    #[test]
    fn sinusoids_and_their_derivatives_are_followed_to_the_sixth_order() {
        let spline = Spline::new();
        // 0.0004 % and 0.3 % of the amplitude.
        assert!(sixth_order_bound(TURN / 8.0, 0) < 2.5e-5 && sixth_order_bound(TURN / 4.0, 0) < 3e-3);
        for period in [16.0, 8.0, 4.0] {
            let omega = TURN / period;
            let epi = spline_through(&spline, 100, |x| (omega * x + 0.4).sin());
            for order in 0..3 {
                // Derivatives of B-splines weigh neighbours by +-2^order at most in all.
                let bound = sixth_order_bound(omega, order as i32) + f64::from(1 << order) * (CUT + ROUNDING);
                for x in -20..120 {
                    for index in (0..FRACTIONS).step_by(37) {
                        let place = x as f64 + index as f64 / FRACTIONS as f64;
                        let phase = omega * place + 0.4 + order as f64 * TURN / 4.0;
                        let truth = omega.powi(order as i32) * phase.sin();
                        let error = sample(&spline, &epi, x, index, order) - truth;
                        assert!(error.abs() <= bound, "period {period}, order {order}, {place}: {error}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_ramp_stays_a_ramp_to_the_borders_and_beyond() {
        let spline = Spline::new();
        // 1.5 DN/px, so 150 DN at the right border.
        let counts: Vec<u16> = (0..101).map(|x| 192 * x).collect();
        let epi = spline_of_counts(&spline, &counts);
        // The ramp goes on for 32 px and more: 200 DN.
        let bound = 200.0 * (CUT + ROUNDING);
        for x in -20..120 {
            for index in [0, 100, 256, 511] {
                let place = x as f64 + index as f64 / FRACTIONS as f64;
                let error = |order, truth: f64| (sample(&spline, &epi, x, index, order) - truth).abs();
                assert!(error(0, 1.5 * place) < bound, "{place}");
                assert!(error(1, 1.5) < 2.0 * bound && error(2, 0.0) < 4.0 * bound, "{place}");
            }
        }
    }

    /// Squared frequency response of `order` at `omega`, mean over the positions between pixels.
    fn mean_power(omega: f64, order: usize) -> f64 {
        let positions = 64;
        let prefilter = 1.0 / quintic::samples_response(omega);
        let power = |index: usize| {
            let fraction = (index as f64 + 0.5) / positions as f64;
            let (mut real, mut imaginary) = (0.0, 0.0);
            for neighbour in -2..=3 {
                let weight = basis(f64::from(neighbour) - fraction, order);
                real += weight * (omega * f64::from(neighbour)).cos();
                imaginary += weight * (omega * f64::from(neighbour)).sin();
            }
            (real * real + imaginary * imaginary) * prefilter * prefilter
        };
        (0..positions).map(power).sum::<f64>() / positions as f64
    }

    /// Mean over all frequencies.
    fn over_frequencies(power: impl Fn(f64) -> f64) -> f64 {
        let steps = 500;
        let sum: f64 = (0..steps).map(|step| power(TURN * (f64::from(step) + 0.5) / f64::from(steps))).sum();
        sum / f64::from(steps)
    }

    #[test]
    fn noise_gains_are_those_of_the_frequency_response() {
        // The constants have three digits.
        let value = over_frequencies(|omega| mean_power(omega, 0));
        assert!((value - VALUE_NOISE_GAIN).abs() < 0.001, "{value}");
        let gradient = over_frequencies(|omega| mean_power(omega, 1));
        assert!((gradient - GRADIENT_NOISE_GAIN).abs() < 0.001, "{gradient}");
        // Resampled along x before it is sampled along x, and along y.
        let twice = over_frequencies(|omega| mean_power(omega, 0).powi(2));
        assert!((twice * value - RESAMPLED_NOISE_GAIN).abs() < 0.001, "{}", twice * value);
    }
}
